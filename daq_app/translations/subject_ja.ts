<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="ja" sourcelanguage="en">
<context>
    <name>subject</name>
    <message>
        <source>Welcome</source>
        <translation>ようこそ</translation>
    </message>
    <message>
        <source>The experimenter will begin in a moment.</source>
        <translation>まもなく実験者が始めます。</translation>
    </message>
    <message>
        <source>Keep your fingers off the surface.</source>
        <translation>指を表面に触れないでください。</translation>
    </message>
    <message>
        <source>Please wait</source>
        <translation>お待ちください</translation>
    </message>
    <message>
        <source>Thank you</source>
        <translation>ありがとうございました</translation>
    </message>
    <message>
        <source>You can rest your hand now.</source>
        <translation>手を休めてください。</translation>
    </message>
    <message>
        <source>Please lift your finger off the surface.</source>
        <translation>指を表面から離してください。</translation>
    </message>
    <message>
        <source>Rest</source>
        <translation>休憩</translation>
    </message>
    <message>
        <source>Rest your hand. The experimenter will go on with you.</source>
        <translation>手を休めてください。実験者が続きを始めます。</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>一時停止</translation>
    </message>
    <message>
        <source>The experimenter will go on in a moment.</source>
        <translation>まもなく実験者が再開します。</translation>
    </message>
    <message>
        <source>Stroke the surface once</source>
        <translation>表面を一回なでてください</translation>
    </message>
    <message>
        <source>Stroke the surface up to {number} times</source>
        <translation>表面を{number}回までなでてください</translation>
    </message>
    <message>
        <source>This one is for practice.</source>
        <translation>これは練習です。</translation>
    </message>
    <message>
        <source>Surface {number} of {count}.</source>
        <translation>表面 {number}／{count}。</translation>
    </message>
    <message>
        <source>Sample {code}.</source>
        <translation>試料 {code}。</translation>
    </message>
    <message>
        <source>Judge the surface</source>
        <translation>表面を評価してください</translation>
    </message>
    <message>
        <source>Give a number above 0, on your own scale.</source>
        <translation>ご自分の尺度で、0より大きい数を答えてください。</translation>
    </message>
    <message>
        <source>Which one?</source>
        <translation>どちらですか。</translation>
    </message>
    <message>
        <source>Next</source>
        <translation>次へ</translation>
    </message>
    <message>
        <source>The first</source>
        <translation>一つ目</translation>
    </message>
    <message>
        <source>The second</source>
        <translation>二つ目</translation>
    </message>
    <message>
        <source>No connection. Your answer is kept on this device.</source>
        <translation>接続がありません。回答はこの端末に保存されています。</translation>
    </message>
    <message>
        <source>Line from {low} to {high}</source>
        <translation>{low}から{high}までの線</translation>
    </message>
    <message>
        <source>No answer yet. The arrow keys move the mark.</source>
        <translation>まだ回答がありません。矢印キーで印を動かします。</translation>
    </message>
    <message>
        <source>Answer at {score} of 100. The arrow keys move the mark.</source>
        <translation>100のうち{score}に回答しました。矢印キーで印を動かします。</translation>
    </message>
    <message>
        <source>Your number, above 0</source>
        <translation>0より大きい数</translation>
    </message>
    <message>
        <source>Which of the two: 1 for the first, 2 for the second</source>
        <translation>どちらですか。1つ目は1、2つ目は2</translation>
    </message>
    <message>
        <source>How hard you press</source>
        <translation>押している強さ</translation>
    </message>
</context>
</TS>

<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="ar" sourcelanguage="en">
<context>
    <name>subject</name>
    <message>
        <source>Welcome</source>
        <translation>مرحبًا</translation>
    </message>
    <message>
        <source>The experimenter will begin in a moment.</source>
        <translation>سيبدأ المُجرِّب بعد قليل.</translation>
    </message>
    <message>
        <source>Keep your fingers off the surface.</source>
        <translation>أبعد أصابعك عن السطح.</translation>
    </message>
    <message>
        <source>Please wait</source>
        <translation>يرجى الانتظار</translation>
    </message>
    <message>
        <source>Thank you</source>
        <translation>شكرًا لك</translation>
    </message>
    <message>
        <source>You can rest your hand now.</source>
        <translation>يمكنك إراحة يدك الآن.</translation>
    </message>
    <message>
        <source>Please lift your finger off the surface.</source>
        <translation>يرجى رفع إصبعك عن السطح.</translation>
    </message>
    <message>
        <source>Rest</source>
        <translation>استراحة</translation>
    </message>
    <message>
        <source>Rest your hand. The experimenter will go on with you.</source>
        <translation>أرح يدك. سيتابع المُجرِّب معك.</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>توقف مؤقت</translation>
    </message>
    <message>
        <source>The experimenter will go on in a moment.</source>
        <translation>سيتابع المُجرِّب بعد قليل.</translation>
    </message>
    <message>
        <source>Stroke the surface once</source>
        <translation>مرّر إصبعك على السطح مرة واحدة</translation>
    </message>
    <message>
        <source>Stroke the surface up to {number} times</source>
        <translation>مرّر إصبعك على السطح، والعدد الأقصى للمرات: {number}</translation>
    </message>
    <message>
        <source>This one is for practice.</source>
        <translation>هذا السطح للتدريب.</translation>
    </message>
    <message>
        <source>Surface {number} of {count}.</source>
        <translation>السطح {number} من {count}.</translation>
    </message>
    <message>
        <source>Sample {code}.</source>
        <translation>العيّنة {code}.</translation>
    </message>
    <message>
        <source>Judge the surface</source>
        <translation>قيّم السطح</translation>
    </message>
    <message>
        <source>Give a number above 0, on your own scale.</source>
        <translation>أعطِ عددًا أكبر من 0 على مقياسك الخاص.</translation>
    </message>
    <message>
        <source>Which one?</source>
        <translation>أيّهما؟</translation>
    </message>
    <message>
        <source>Next</source>
        <translation>التالي</translation>
    </message>
    <message>
        <source>The first</source>
        <translation>الأول</translation>
    </message>
    <message>
        <source>The second</source>
        <translation>الثاني</translation>
    </message>
    <message>
        <source>No connection. Your answer is kept on this device.</source>
        <translation>لا يوجد اتصال. إجابتك محفوظة على هذا الجهاز.</translation>
    </message>
    <message>
        <source>Line from {low} to {high}</source>
        <translation>خط من {low} إلى {high}</translation>
    </message>
    <message>
        <source>No answer yet. The arrow keys move the mark.</source>
        <translation>لا توجد إجابة بعد. تحرّك مفاتيح الأسهم العلامة.</translation>
    </message>
    <message>
        <source>Answer at {score} of 100. The arrow keys move the mark.</source>
        <translation>الإجابة عند {score} من 100. تحرّك مفاتيح الأسهم العلامة.</translation>
    </message>
    <message>
        <source>Your number, above 0</source>
        <translation>رقمك، أكبر من 0</translation>
    </message>
    <message>
        <source>Which of the two: 1 for the first, 2 for the second</source>
        <translation>أيّهما: 1 للأول و2 للثاني</translation>
    </message>
    <message>
        <source>How hard you press</source>
        <translation>مدى قوة ضغطك</translation>
    </message>
</context>
</TS>

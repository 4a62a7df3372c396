<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
<context>
    <name>subject</name>
    <message>
        <source>Welcome</source>
        <translation>Willkommen</translation>
    </message>
    <message>
        <source>The experimenter will begin in a moment.</source>
        <translation>Die Versuchsleitung beginnt gleich.</translation>
    </message>
    <message>
        <source>Keep your fingers off the surface.</source>
        <translation>Lassen Sie die Finger von der Oberfläche.</translation>
    </message>
    <message>
        <source>Please wait</source>
        <translation>Bitte warten</translation>
    </message>
    <message>
        <source>Thank you</source>
        <translation>Danke</translation>
    </message>
    <message>
        <source>You can rest your hand now.</source>
        <translation>Sie können Ihre Hand jetzt ausruhen.</translation>
    </message>
    <message>
        <source>Please lift your finger off the surface.</source>
        <translation>Bitte heben Sie den Finger von der Oberfläche.</translation>
    </message>
    <message>
        <source>Rest</source>
        <translation>Pause</translation>
    </message>
    <message>
        <source>Rest your hand. The experimenter will go on with you.</source>
        <translation>Ruhen Sie Ihre Hand aus. Die Versuchsleitung macht mit Ihnen weiter.</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>Unterbrechung</translation>
    </message>
    <message>
        <source>The experimenter will go on in a moment.</source>
        <translation>Die Versuchsleitung macht gleich weiter.</translation>
    </message>
    <message>
        <source>Stroke the surface once</source>
        <translation>Streichen Sie einmal über die Oberfläche</translation>
    </message>
    <message>
        <source>Stroke the surface up to {number} times</source>
        <translation>Streichen Sie bis zu {number} Mal über die Oberfläche</translation>
    </message>
    <message>
        <source>This one is for practice.</source>
        <translation>Diese hier ist zum Üben.</translation>
    </message>
    <message>
        <source>Surface {number} of {count}.</source>
        <translation>Oberfläche {number} von {count}.</translation>
    </message>
    <message>
        <source>Sample {code}.</source>
        <translation>Probe {code}.</translation>
    </message>
    <message>
        <source>Judge the surface</source>
        <translation>Beurteilen Sie die Oberfläche</translation>
    </message>
    <message>
        <source>Give a number above 0, on your own scale.</source>
        <translation>Geben Sie eine Zahl über 0 an, auf Ihrer eigenen Skala.</translation>
    </message>
    <message>
        <source>Which one?</source>
        <translation>Welche?</translation>
    </message>
    <message>
        <source>Next</source>
        <translation>Weiter</translation>
    </message>
    <message>
        <source>The first</source>
        <translation>Die erste</translation>
    </message>
    <message>
        <source>The second</source>
        <translation>Die zweite</translation>
    </message>
    <message>
        <source>No connection. Your answer is kept on this device.</source>
        <translation>Keine Verbindung. Ihre Antwort bleibt auf diesem Gerät gespeichert.</translation>
    </message>
    <message>
        <source>Line from {low} to {high}</source>
        <translation>Linie von {low} bis {high}</translation>
    </message>
    <message>
        <source>No answer yet. The arrow keys move the mark.</source>
        <translation>Noch keine Antwort. Die Pfeiltasten bewegen die Marke.</translation>
    </message>
    <message>
        <source>Answer at {score} of 100. The arrow keys move the mark.</source>
        <translation>Antwort bei {score} von 100. Die Pfeiltasten bewegen die Marke.</translation>
    </message>
    <message>
        <source>Your number, above 0</source>
        <translation>Ihre Zahl, größer als 0</translation>
    </message>
    <message>
        <source>Which of the two: 1 for the first, 2 for the second</source>
        <translation>Welche der beiden: 1 für die erste, 2 für die zweite</translation>
    </message>
    <message>
        <source>How hard you press</source>
        <translation>Wie fest Sie drücken</translation>
    </message>
</context>
</TS>

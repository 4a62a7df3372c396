<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="fr" sourcelanguage="en">
<context>
    <name>subject</name>
    <message>
        <source>Welcome</source>
        <translation>Bienvenue</translation>
    </message>
    <message>
        <source>The experimenter will begin in a moment.</source>
        <translation>L'expérimentateur va commencer dans un instant.</translation>
    </message>
    <message>
        <source>Keep your fingers off the surface.</source>
        <translation>Ne posez pas les doigts sur la surface.</translation>
    </message>
    <message>
        <source>Please wait</source>
        <translation>Veuillez patienter</translation>
    </message>
    <message>
        <source>Thank you</source>
        <translation>Merci</translation>
    </message>
    <message>
        <source>You can rest your hand now.</source>
        <translation>Vous pouvez reposer votre main maintenant.</translation>
    </message>
    <message>
        <source>Please lift your finger off the surface.</source>
        <translation>Veuillez retirer le doigt de la surface.</translation>
    </message>
    <message>
        <source>Rest</source>
        <translation>Repos</translation>
    </message>
    <message>
        <source>Rest your hand. The experimenter will go on with you.</source>
        <translation>Reposez votre main. L'expérimentateur reprendra avec vous.</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>Pause</translation>
    </message>
    <message>
        <source>The experimenter will go on in a moment.</source>
        <translation>L'expérimentateur reprendra dans un instant.</translation>
    </message>
    <message>
        <source>Stroke the surface once</source>
        <translation>Passez une fois le doigt sur la surface</translation>
    </message>
    <message>
        <source>Stroke the surface up to {number} times</source>
        <translation>Passez le doigt sur la surface jusqu'à {number} fois</translation>
    </message>
    <message>
        <source>This one is for practice.</source>
        <translation>Celle-ci est pour s'exercer.</translation>
    </message>
    <message>
        <source>Surface {number} of {count}.</source>
        <translation>Surface {number} sur {count}.</translation>
    </message>
    <message>
        <source>Sample {code}.</source>
        <translation>Échantillon {code}.</translation>
    </message>
    <message>
        <source>Judge the surface</source>
        <translation>Jugez la surface</translation>
    </message>
    <message>
        <source>Give a number above 0, on your own scale.</source>
        <translation>Donnez un nombre supérieur à 0, sur votre propre échelle.</translation>
    </message>
    <message>
        <source>Which one?</source>
        <translation>Laquelle ?</translation>
    </message>
    <message>
        <source>Next</source>
        <translation>Suivant</translation>
    </message>
    <message>
        <source>The first</source>
        <translation>La première</translation>
    </message>
    <message>
        <source>The second</source>
        <translation>La seconde</translation>
    </message>
    <message>
        <source>No connection. Your answer is kept on this device.</source>
        <translation>Pas de connexion. Votre réponse est conservée sur cet appareil.</translation>
    </message>
    <message>
        <source>Line from {low} to {high}</source>
        <translation>Ligne de {low} à {high}</translation>
    </message>
    <message>
        <source>No answer yet. The arrow keys move the mark.</source>
        <translation>Pas encore de réponse. Les flèches du clavier déplacent la marque.</translation>
    </message>
    <message>
        <source>Answer at {score} of 100. The arrow keys move the mark.</source>
        <translation>Réponse à {score} sur 100. Les flèches du clavier déplacent la marque.</translation>
    </message>
    <message>
        <source>Your number, above 0</source>
        <translation>Votre nombre, supérieur à 0</translation>
    </message>
    <message>
        <source>Which of the two: 1 for the first, 2 for the second</source>
        <translation>Laquelle des deux : 1 pour la première, 2 pour la seconde</translation>
    </message>
    <message>
        <source>How hard you press</source>
        <translation>La force avec laquelle vous appuyez</translation>
    </message>
</context>
</TS>

{% include "sha256.js" %}

{% include "engine.js" %}

{% include "player.js" %}

{% include "replay.js" %}

{% include "panel.js" %}

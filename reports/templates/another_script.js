{% include "sha256.js" %}

{% include "engine.js" %}

{% include "replay.js" %}

{% include "panel_numbers.js" %}

{% include "panel_commands.js" %}

{% include "another.js" %}
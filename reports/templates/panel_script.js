{% include "sha256.js" %}

{% include "engine.js" %}

{% include "player.js" %}

{% include "replay.js" %}

{% include "panel_numbers.js" %}

{% include "panel_commands.js" %}

{% include "panel_crew.js" %}

{% include "panel_grid.js" %}

{% include "panel.js" %}
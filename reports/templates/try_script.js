{% include "engine.js" %}

{% include "panel_numbers.js" %}

{% include "panel_crew.js" %}

{% include "try.js" %}
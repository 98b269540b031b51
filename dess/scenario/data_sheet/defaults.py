"""What is assumed where a data sheet does not say it."""

from dess.scenario.rotary_wing import INDUCED_SPEED, TIP_SPEED

ASSUMED = {
    "modulation": "shannon",
    "max_rate": "6 bit/s/Hz",
    "altitude": "10 m",
    "message": "1 kB",
    "free_space": "1 m",
    "tip_speed": f"{TIP_SPEED:g} m/s",
    "induced_speed": f"{INDUCED_SPEED:g} m/s",
    "climb": "3 m/s",
    "delivery": "14 d",
}

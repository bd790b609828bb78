"""The world: aircraft, weather, ice, instruments, and the Gymnasium environments."""

from icing_env.registration import register

register()

"""What holds for all tests: no test asserts a time, so no generated example has a deadline."""

from hypothesis import HealthCheck, settings

settings.register_profile("multiradar", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("multiradar")

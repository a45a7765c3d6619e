"""Makes the environments known to gymnasium."""

ID = "policyc/Converter-v0"


def register() -> None:
    """Registers ``policyc/Converter-v0``, if gymnasium is installed; ``import policyc`` does it."""
    try:
        from gymnasium.envs import registration
    except ImportError:
        return
    if ID not in registration.registry:
        registration.register(
            ID,
            entry_point="policyc.environment:ConverterEnv",
            vector_entry_point="policyc.environment:ConverterVectorEnv",
        )

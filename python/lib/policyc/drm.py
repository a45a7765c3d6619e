"""Duty ratio mapping: ``policyc.drm.fit`` is :func:`policyc.drm_fit`."""

from .analysis import MappingFit
from .analysis import drm_fit as fit

__all__ = ["MappingFit", "fit"]

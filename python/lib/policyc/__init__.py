"""policyc: trained controllers of power converters, compiled to verified C and Rust.

    >>> import policyc
    >>> policy = policyc.Policy.load("examples/buck12")
    >>> files = policy.compile(target="cortex-m4f", emit=["c"])   # name -> bytes, as the command writes them
    >>> policy.verify(steps=2000).equal
    True

What is wrong with an input comes as :class:`Faults`, with places. The environment of gymnasium is ``policyc/Converter-v0``.
"""

from . import drm
from ._policyc import Command, Fault, Faults, __version__
from .analysis import Diagnosis, MappingFit, Simulation, diagnose, drm_fit, simulate
from .campaigns import Campaign, campaign
from .controller import Controller, Status, Steps
from .exporting import export
from .policy import Certificate, Feature, Inspection, Layer, Policy, Signal, Verification
from .registration import register

register()

__all__ = [
    "Campaign",
    "Certificate",
    "Command",
    "Controller",
    "Diagnosis",
    "Fault",
    "Faults",
    "Feature",
    "Inspection",
    "Layer",
    "MappingFit",
    "Policy",
    "Signal",
    "Simulation",
    "Status",
    "Steps",
    "Verification",
    "__version__",
    "campaign",
    "diagnose",
    "drm",
    "drm_fit",
    "export",
    "simulate",
]

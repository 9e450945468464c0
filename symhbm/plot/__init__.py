"""Figures from datasets, and drawings of models."""

from symhbm.plot.backbone import backbone
from symhbm.plot.contact import contact_map, hysteresis, normal_force, states, stick_map
from symhbm.plot.curves import curve, response
from symhbm.plot.disks import campbell, disk, interference
from symhbm.plot.drawing import LINE_STYLES, MOST_LEGEND_ENTRIES, SYMBOLS, nothing_to_draw
from symhbm.plot.ensemble import blades, envelope
from symhbm.plot.figures import FORMATS, STYLE, panels, save
from symhbm.plot.front import pareto_front
from symhbm.plot.measurements import next_measurements
from symhbm.plot.phase import bode, nyquist, phase, phase_portrait, transmissibility
from symhbm.plot.structure import model
from symhbm.plot.unforced import flutter_limit, limit_cycles, nonlinear_modes

__all__ = [
    "FORMATS",
    "LINE_STYLES",
    "MOST_LEGEND_ENTRIES",
    "STYLE",
    "SYMBOLS",
    "backbone",
    "blades",
    "bode",
    "campbell",
    "contact_map",
    "curve",
    "disk",
    "envelope",
    "flutter_limit",
    "hysteresis",
    "interference",
    "limit_cycles",
    "model",
    "next_measurements",
    "nonlinear_modes",
    "normal_force",
    "nothing_to_draw",
    "nyquist",
    "panels",
    "pareto_front",
    "phase",
    "phase_portrait",
    "response",
    "save",
    "states",
    "stick_map",
    "transmissibility",
]

"""A closed-loop software-in-the-loop testbed for highway ADAS.

>>> import closecall as cc
>>> scenario = cc.Scenario.load("low-thw-overtake")
>>> outcome = cc.run(scenario, controller="mis", sample=3)
>>> result = cc.campaign(scenario, n=1000, controller="mis", paired=True)

Units are part of the names: ``gap_m`` (m), ``speed_mps`` (m/s), ``acceleration_mps2`` (m/s²), ``thw_s`` (s).
Positions of tracks are in the ego's frame: x ahead, y to the left, origin at the centre of the ego.
"""

from ._campaign import CampaignOptions, CampaignResult, campaign
from ._controller import Controller, State
from ._errors import ClosecallError, FileError, InputError, SampleError, UsageError
from ._native import VERSION as __version__
from ._native import ControllerInput, LeadVehicle, Odometry, Sensors, Setup, Table, Track
from ._outcome import Collision, Margins, MisSummary, Moment, Outcome, Promise
from ._run import run
from ._scenario import Scenario
from ._traffic import Rows, criticality, fit, lane_changes

__all__ = [
    "CampaignOptions",
    "CampaignResult",
    "ClosecallError",
    "Collision",
    "Controller",
    "ControllerInput",
    "FileError",
    "InputError",
    "LeadVehicle",
    "Margins",
    "MisSummary",
    "Moment",
    "Odometry",
    "Outcome",
    "Promise",
    "Rows",
    "SampleError",
    "Scenario",
    "Sensors",
    "Setup",
    "State",
    "Table",
    "Track",
    "UsageError",
    "__version__",
    "campaign",
    "criticality",
    "fit",
    "lane_changes",
    "run",
]

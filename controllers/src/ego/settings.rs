//! The ego stack as a scenario file describes it.

use closecall_traffic::{Check, ConfigError, Parameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::acc::{AccPatch, GapPolicy};
use super::{Acc, AccConfig, Aeb, AebConfig, EgoController, EgoDriver, EgoStack, Horizon, MisConfig, MisSettings};
use crate::driver::FollowConfig;

/// The ego stack as a scenario file describes it. An absent function is not part of the stack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct EgoStackConfig {
    /// Adaptive cruise control.
    pub acc: AccConfig,
    /// Emergency braking.
    pub aeb: Option<AebConfig>,
    /// The margin increase system.
    pub mis: Option<MisConfig>,
    /// The human driver of the arms `human-aeb` and `human+aeb`, in which no cruise control drives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub human: Option<FollowConfig>,
    /// Whether the ego is in automated mode. If not, the margin increase system never engages; the
    /// same control laws then represent an attentive driver.
    #[serde(default = "default_automated")]
    pub automated: bool,
}

fn default_automated() -> bool {
    true
}

/// A checked ego stack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EgoSettings {
    pub(crate) acc: Acc,
    pub(crate) aeb: Option<Aeb>,
    pub(crate) mis: Option<MisSettings>,
    pub(crate) automated: bool,
    /// The human driver of the arms in which a human drives. No controller from outside is told of it.
    #[serde(skip)]
    pub(crate) human: Option<EgoDriver>,
    /// Whether that driver drives in place of the cruise control.
    #[serde(skip)]
    pub(crate) is_human: bool,
}

impl EgoSettings {
    /// Returns the same stack without the margin increase system: the controller `acc`.
    #[must_use]
    pub fn without_mis(self) -> Self {
        Self { mis: None, ..self }
    }

    /// Returns the same stack without the margin increase system, and with another constant time
    /// gap (s): the controllers `gap-<seconds>`.
    #[must_use]
    pub fn with_time_gap(self, time_gap_s: f64) -> Self {
        Self { acc: Acc { time_gap_s, policy: GapPolicy::Constant, ..self.acc }, ..self.without_mis() }
    }

    /// Returns the same stack without the margin increase system, and with the minimum following
    /// distance of UN Regulation 157: the controller `r157-gap`.
    #[must_use]
    pub fn with_r157_gap(self) -> Self {
        Self { acc: Acc { policy: GapPolicy::R157, ..self.acc }, ..self.without_mis() }
    }

    /// Returns the stack of the fuzzy safety model of UN Regulation 157: the same cruise control
    /// with the gap of the model, and nothing else. The model brakes instead of the emergency
    /// braking system: the controller `r157-fsm`.
    #[must_use]
    pub fn with_fuzzy_safety(self) -> Self {
        Self { acc: Acc { policy: GapPolicy::FuzzySafety, ..self.acc }, aeb: None, ..self.without_mis() }
    }

    /// Returns the same stack with the extended margin increase system, if it has one at all: the
    /// controller `mis-extended`.
    #[must_use]
    pub fn with_extended_mis(self) -> Self {
        Self { mis: self.mis.map(MisSettings::extended), ..self }
    }

    /// Returns the same stack with a margin increase system that plans for the time to closest
    /// encounter, if it has one at all: the controller `mis-ttce`.
    #[must_use]
    pub fn with_ttce_mis(self) -> Self {
        Self { mis: self.mis.map(|mis| MisSettings { horizon: Horizon::Ttce, ..mis }), ..self }
    }

    /// Returns the same stack with the scenario's emergency braking, or with one of default values.
    #[must_use]
    pub fn with_aeb(self) -> Self {
        Self { aeb: self.aeb.or(Some(Aeb::DEFAULT)), ..self }
    }

    /// Returns the same stack without emergency braking.
    #[must_use]
    pub fn without_aeb(self) -> Self {
        Self { aeb: None, ..self }
    }

    /// Returns the same stack with a cruise control that does not look ahead.
    #[must_use]
    pub fn without_following(self) -> Self {
        Self { acc: Acc { policy: GapPolicy::Unwatched, ..self.acc }, ..self }
    }

    /// Returns the stack in which the human driver of the scenario drives: no cruise control and no margin increase system.
    #[must_use]
    pub fn with_human(self) -> Self {
        Self { is_human: true, ..self.without_mis() }
    }

    /// Returns the human driver who drives the ego; `None` if a controller does.
    pub fn driver(&self) -> Option<&EgoDriver> {
        self.human.as_ref().filter(|_| self.is_human)
    }

    /// Returns true if a human is to drive, and the scenario has no human driver of the ego.
    pub fn lacks_driver(&self) -> bool {
        self.is_human && self.human.is_none()
    }

    /// Returns the human driver of the scenario, whether it drives or not.
    pub fn human(&self) -> Option<&EgoDriver> {
        self.human.as_ref()
    }

    /// Returns the same stack with these settings in place of its own. A function that it lacks stays absent.
    #[must_use]
    pub fn patched(self, patch: &StackPatch) -> Self {
        patch.over(self, &Parameters::default()).unwrap_or(self)
    }

    /// Returns the gap that the adaptive cruise control keeps at `speed_mps` (m).
    pub fn desired_gap_m(&self, speed_mps: f64) -> f64 {
        self.acc.desired_gap_m(speed_mps)
    }

    /// Returns the settings of the margin increase system, or `None` if the stack has none.
    pub fn mis(&self) -> Option<&MisSettings> {
        self.mis.as_ref()
    }

    /// Returns the time gap of the adaptive cruise control (s).
    pub fn time_gap_s(&self) -> f64 {
        self.acc.time_gap_s
    }

    /// Builds a new controller for one run.
    pub fn build(&self) -> Box<dyn EgoController> {
        Box::new(EgoStack::new(*self))
    }
}

/// Settings of single functions that replace a scenario's settings.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct StackPatch {
    acc: AccPatch,
    aeb: AebConfig,
    mis: MisConfig,
}

impl StackPatch {
    /// Reads lines of the form `aeb.trigger-mps2=5`.
    ///
    /// # Errors
    /// What is wrong, and what is allowed: an unknown key, a value that is not a number, or one that is out of range.
    pub fn parse(lines: &str) -> Result<Self, String> {
        let patch: Self = toml::from_str(lines).map_err(|error| error.message().to_owned())?;
        let stack = EgoSettings {
            acc: Acc { time_gap_s: 1.0, set_speed_mps: None, standstill_gap_m: 3.0, policy: GapPolicy::Constant },
            aeb: Some(Aeb::DEFAULT),
            mis: Some(MisSettings::PAPER),
            automated: true,
            human: None,
            is_human: false,
        };
        patch.over(stack, &Parameters::default()).map_err(|error| error.to_string())?;
        Ok(patch)
    }

    fn over(&self, stack: EgoSettings, parameters: &Parameters) -> Result<EgoSettings, ConfigError> {
        let aeb = stack.aeb.map(|aeb| self.aeb.over(aeb, parameters).map_err(|error| error.within("aeb")));
        let mis = stack.mis.map(|mis| self.mis.over(mis, parameters).map_err(|error| error.within("mis")));
        Ok(EgoSettings {
            acc: self.acc.over(stack.acc, parameters).map_err(|error| error.within("acc"))?,
            aeb: aeb.transpose()?,
            mis: mis.transpose()?,
            ..stack
        })
    }
}

impl Check for EgoStackConfig {
    type Checked = EgoSettings;

    fn check(&self, parameters: &Parameters) -> Result<EgoSettings, ConfigError> {
        let aeb = self.aeb.as_ref().map(|config| config.check(parameters).map_err(|error| error.within("aeb")));
        let mis = self.mis.as_ref().map(|config| config.check(parameters).map_err(|error| error.within("mis")));
        let human = self
            .human
            .as_ref()
            .map(|config| EgoDriver::check(config, parameters).map_err(|error| error.within("human")));
        Ok(EgoSettings {
            acc: self.acc.check(parameters).map_err(|error| error.within("acc"))?,
            aeb: aeb.transpose()?,
            mis: mis.transpose()?,
            automated: self.automated,
            human: human.transpose()?,
            is_human: false,
        })
    }
}

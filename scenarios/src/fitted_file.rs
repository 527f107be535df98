//! Fitted distributions that replace the distributions of a scenario: a file that
//! `closecall traffic fit` wrote, or a file of the same form.
//!
//! A parameter takes the distribution of the entry that was fitted to the same values: to the same
//! quantity in the same range. Without one, it takes the entry of its name. A log-normal
//! distribution that the scenario cuts takes the log-normal form of the file, and keeps its cut.
//! Traffic shows values that a scenario cannot use, such as a closing speed of a millimetre per
//! second for a vehicle that is to arrive. They are cut to the nearest value that it can use, with
//! a note that states their share. A scenario that cannot use more than a tenth of the values is
//! refused. The replacement is a [`Setting`], so that manifests, recordings and JSON state it, with
//! the hash of the file.

use std::path::{Path, PathBuf};

use closecall_recorded::fit::Quantity;
use closecall_traffic::{ParameterName, Value};

use super::parameters::{ParameterConfig, ParametersConfig};
use super::{ScenarioError, ScenarioFile, Setting};

/// Largest share of the values of a distribution that is cut (-): beyond it, the scenario asks
/// about something else than the data. An assumption; 0.05 to 0.2 are plausible.
const MOST_CUT: f64 = 0.1;
/// Number of halvings by which the end of the usable values is searched: numerical.
const HALVINGS: u32 = 50;
/// Steps of a cut per unit of the parameter: a file of fitted distributions states three decimals.
const CUT_STEPS: f64 = 1e3;

/// A file of fitted distributions.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedFile {
    path: PathBuf,
    /// The provenance of the file in words, with the hash of the content.
    source: String,
    parameters: ParametersConfig,
    /// The parametric forms, if the file has any.
    parametric: ParametersConfig,
}

/// The values to which a distribution was fitted: a quantity, and the range of its values.
#[derive(Clone, Debug, PartialEq)]
struct FittedTo<'a> {
    quantity: &'a str,
    cut: Option<[f64; 2]>,
}

impl<'a> FittedTo<'a> {
    fn of(name: &'a str, config: &'a ParameterConfig) -> Self {
        let fitted = config.fitted.as_ref();
        Self {
            quantity: fitted.and_then(|fitted| fitted.quantity.as_deref()).unwrap_or(name),
            cut: fitted.and_then(|fitted| fitted.cut),
        }
    }
}

impl FittedFile {
    /// Reads a file of fitted distributions.
    ///
    /// # Errors
    /// [`ScenarioError`] if the file cannot be read, or a distribution is not valid.
    pub fn read(path: &Path) -> Result<Self, ScenarioError> {
        let read = |source| ScenarioError::Read { path: path.to_owned(), source };
        let text = closecall_traffic::input::read_text(path).map_err(read)?;
        let hash = blake3::hash(text.as_bytes()).to_hex();
        let source = format!("from {} (blake3 {})", path.display(), hash.get(..16).unwrap_or_default());
        let wrong = |message: String| ScenarioError::Syntax { path: path.to_owned(), line: Some(1), message };
        let mut document: toml::Table =
            text.parse().map_err(|error: toml::de::Error| wrong(error.message().to_owned()))?;
        let mut table = |name: &str| match document.remove(name) {
            Some(value) => {
                value.try_into::<ParametersConfig>().map_err(|error| wrong(format!("[{name}]: {}", error.message())))
            }
            None => Ok(ParametersConfig::default()),
        };
        let (parameters, parametric) = (table("parameters")?, table("parametric")?);
        if parameters.0.is_empty() {
            return Err(wrong("there is no table `parameters` with fitted distributions".to_owned()));
        }
        parameters.check().map_err(|error| wrong(error.within("parameters").to_string()))?;
        Ok(Self { path: path.to_owned(), source, parameters, parametric })
    }

    /// Returns the settings that give the parameters of a scenario the distributions of this file,
    /// and a note on each distribution that is cut.
    ///
    /// # Errors
    /// [`ScenarioError`] if an entry of the file is neither a parameter of the scenario nor a
    /// quantity of `traffic fit`, if no parameter takes a distribution, or if the scenario cannot
    /// use most of the values of one.
    pub fn settings(&self, scenario: &ScenarioFile) -> Result<(Vec<Setting>, Vec<String>), ScenarioError> {
        let parameters = &scenario.config().parameters.0;
        let allowed = || parameters.keys().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let name = &scenario.config().name;
        let refuse = |message: String| self.refused(message);
        let is_known = |entry: &str| {
            parameters.keys().any(|parameter| parameter.as_str() == entry)
                || Quantity::ALL.iter().any(|quantity| quantity.name() == entry)
        };
        if let Some(unknown) = self.parameters.0.keys().find(|entry| !is_known(entry.as_str())) {
            return Err(refuse(format!("`{unknown}` is not a parameter of {name}: allowed are {}", allowed())));
        }
        let replacement = |(parameter, config): (&ParameterName, &ParameterConfig)| {
            Some((parameter.clone(), self.replacement(parameter.as_str(), config)?))
        };
        let mut replaced: Vec<_> = parameters.iter().filter_map(replacement).collect();
        if replaced.is_empty() {
            return Err(refuse(format!("no entry replaces a parameter of {name}: allowed are {}", allowed())));
        }
        let notes = self.cut(scenario, &mut replaced)?;
        Ok((self.as_settings(&replaced)?, notes))
    }

    fn refused(&self, message: String) -> ScenarioError {
        ScenarioError::Syntax { path: self.path.clone(), line: Some(1), message }
    }

    fn as_settings(&self, replaced: &[(ParameterName, ParameterConfig)]) -> Result<Vec<Setting>, ScenarioError> {
        let setting = |(parameter, config): &(ParameterName, ParameterConfig)| {
            let value = toml::Value::try_from(config).map_err(|error| self.refused(error.to_string()))?;
            let setting = format!("parameters.{parameter}={value}").parse::<Setting>();
            setting.map_err(|source| ScenarioError::Set { path: self.path.clone(), source })
        };
        replaced.iter().map(setting).collect()
    }

    /// Cuts distributions to the values that the scenario can use while the other parameters have
    /// their nominal values. Returns a note on each that is cut.
    fn cut(
        &self,
        scenario: &ScenarioFile,
        replaced: &mut [(ParameterName, ParameterConfig)],
    ) -> Result<Vec<String>, ScenarioError> {
        let file = ScenarioFile::parse(scenario.path(), scenario.text(), &self.as_settings(replaced)?)?;
        let nominal = file.space().nominal();
        let mut notes = Vec::new();
        if file.concrete(&nominal).is_err() {
            // No cut helps. The check of the scenario says what is wrong.
            return Ok(notes);
        }
        for (name, config) in replaced {
            let Some(distribution) = file.space().get(name).map(|entry| &entry.distribution) else { continue };
            let (Some(bounds), Some(Value::Number(median))) = (distribution.bounds(), nominal.get(name)) else {
                continue;
            };
            let is_usable = |value: f64| {
                let mut parameters = nominal.clone();
                parameters.insert(name.clone(), Value::Number(value));
                file.concrete(&parameters).is_ok()
            };
            let limits = bounds.map(|bound| usable_end(*median, bound, is_usable));
            if limits == bounds {
                continue;
            }
            let [below, within] = limits.map(|limit| distribution.cdf(limit).unwrap_or_default());
            let share = below + 1.0 - within;
            let [low, high] = limits.map(|limit| (limit * CUT_STEPS).round() / CUT_STEPS);
            let can_use = format!("{:.1} % of the fitted values lie beyond the {low} to {high}", 100.0 * share);
            let scenario = &scenario.config().name;
            if !(share <= MOST_CUT) {
                let most = 100.0 * MOST_CUT;
                let message = format!("`{name}`: {can_use} that {scenario} can use; at most {most} % are cut");
                return Err(self.refused(message));
            }
            let changed = [0, 1].map(|end| (limits[end] != bounds[end]).then_some(limits[end]));
            config.cut(changed);
            config.note = config.note.take().map(|note| format!("{note}; cut: {can_use} that the scenario can use"));
            notes.push(format!("`{name}`: {can_use} that {scenario} can use, and are cut to it"));
        }
        Ok(notes)
    }

    /// Returns the distribution of this file that replaces one of a scenario.
    fn replacement(&self, name: &str, config: &ParameterConfig) -> Option<ParameterConfig> {
        let wanted = FittedTo::of(name, config);
        let same = |(entry, other): &(&_, &ParameterConfig)| FittedTo::of(as_str(entry), other) == wanted;
        let (entry, entry_config) = self
            .parameters
            .0
            .iter()
            .filter(|_| config.fitted.is_some())
            .find(same)
            .or_else(|| self.parameters.0.iter().find(|(entry, _)| entry.as_str() == name))?;
        let is_cut = config.log_normal.as_ref().filter(|form| form.min.is_some() || form.max.is_some());
        let form = self.parametric.0.get(entry);
        let (mut taken, note) = match (is_cut, form.and_then(|form| Some((form, form.log_normal?)))) {
            (Some(cut), Some((form, log_normal))) => {
                let log_normal = super::parameters::LogNormalConfig { min: cut.min, max: cut.max, ..log_normal };
                (ParameterConfig { log_normal: Some(log_normal), ..form.clone() }, ", with the cut of the scenario")
            }
            _ => (entry_config.clone(), ""),
        };
        if let Some(fitted) = &mut taken.fitted {
            let FittedTo { quantity, cut } = FittedTo::of(entry.as_str(), entry_config);
            (fitted.quantity, fitted.cut) = (Some(quantity.to_owned()), cut);
        }
        // The correlations of the file are with its other entries, which the scenario may not have.
        taken.spearman = config.spearman.clone();
        taken.note = Some(format!("{}{note}", self.source));
        Some(taken)
    }
}

/// Returns the value nearest to `bound` that a scenario can use, in the direction of a value that
/// it can use. `is_usable` is asked for single values.
fn usable_end(usable: f64, bound: f64, is_usable: impl Fn(f64) -> bool) -> f64 {
    if is_usable(bound) {
        return bound;
    }
    let (mut inner, mut outer) = (usable, bound);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inner + outer);
        if is_usable(middle) { inner = middle } else { outer = middle }
    }
    let steps = inner * CUT_STEPS;
    let rounded = if bound < usable { steps.ceil() } else { steps.floor() } / CUT_STEPS;
    let is_between = (rounded - inner) * (rounded - usable) <= 0.0;
    if is_between && is_usable(rounded) { rounded } else { inner }
}

fn as_str(name: &closecall_traffic::ParameterName) -> &str {
    name.as_str()
}

#[cfg(test)]
mod tests {
    use super::super::library;
    use super::*;

    fn headline() -> ScenarioFile {
        ScenarioFile::parse(Path::new("a.toml"), library::text("low-thw-overtake").unwrap(), &[]).unwrap()
    }

    fn fitted(text: &str) -> FittedFile {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fitted.toml");
        std::fs::write(&path, text).unwrap();
        FittedFile::read(&path).unwrap()
    }

    #[test]
    fn a_parameter_takes_the_entry_that_was_fitted_to_the_same_values() {
        let us101 = fitted(include_str!("../library/fitted/us101.toml"));
        let (settings, notes) = us101.settings(&headline()).unwrap();
        // A rear vehicle that closes in by a millimetre per second does not arrive.
        let expected = "`closing-mps`: 4.1 % of the fitted values lie beyond the 0.101 to 4.15 that low-thw-overtake can use, \
                        and are cut to it";
        assert_eq!(notes, [expected]);
        let text = library::text("low-thw-overtake").unwrap();
        let file = ScenarioFile::parse(Path::new("a.toml"), text, &settings).unwrap();
        let config =
            |name: &str| file.config().parameters.0.iter().find(|(parameter, _)| parameter.as_str() == name).unwrap().1;
        let [before, after] = [headline().config().clone(), file.config().clone()].map(|config| config.parameters);
        for name in ["front-thw-s", "lane-change-duration-s"] {
            let quantiles = |all: &ParametersConfig| {
                all.0.iter().find(|(parameter, _)| parameter.as_str() == name).unwrap().1.empirical.clone().unwrap()
            };
            assert_eq!(quantiles(&before), quantiles(&after), "{name}: the library was fitted to the same file");
        }
        // The cut of the headway at the crossing is a choice of the scenario.
        let cut_out = config("cut-out-thw-s");
        let form = cut_out.log_normal.unwrap();
        assert_eq!((form.median, form.min, form.max), (0.758, Some(0.15), Some(0.4)));
        // `closing-mps` is assumed in the scenario, and has an entry of its name.
        assert_eq!(config("closing-mps").fitted.as_ref().unwrap().n, 13);
        assert_eq!(config("closing-mps").empirical.as_ref().unwrap().quantiles[..3], [0.101, 0.247, 0.585]);
        assert!(config("closing-mps").note.as_ref().unwrap().contains("cut: 4.1 %"));
        file.check().unwrap();
        assert!(config("front-thw-s").note.as_ref().unwrap().contains("blake3"));
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_allowed_ones() {
        let entry = |name: &str| format!("[parameters]\n{name} = {{ uniform = {{ min = 1, max = 2 }} }}\n");
        let message = fitted(&entry("front-thw")).settings(&headline()).unwrap_err().to_string();
        assert!(
            message.contains("`front-thw` is not a parameter of low-thw-overtake: allowed are brake-mps2"),
            "{message}"
        );
        let message = fitted(&entry("crossing-mps")).settings(&headline()).unwrap_err().to_string();
        assert!(message.contains("no entry replaces a parameter of low-thw-overtake"), "{message}");
        assert_eq!(fitted(&entry("brake-mps2")).settings(&headline()).unwrap().0.len(), 1);
    }

    #[test]
    fn every_form_is_cut_and_a_distribution_that_is_mostly_useless_is_refused() {
        // The braking of this scenario is above 0 and at most 12 m/s².
        for form in [
            "empirical = { quantiles = [-0.2, 5.0, 6.0] }",
            "uniform = { min = -0.2, max = 6.0 }",
            "truncated-normal = { mean = 4.0, sd = 2.0, min = -0.5, max = 8.0 }",
            "log-normal = { median = 5.0, sigma = 0.6 }",
        ] {
            let file = fitted(&format!("[parameters]\nbrake-mps2 = {{ {form} }}\n"));
            let (settings, notes) = file.settings(&headline()).unwrap();
            assert_eq!(notes.len(), 1, "{form}");
            let text = library::text("low-thw-overtake").unwrap();
            ScenarioFile::parse(Path::new("a.toml"), text, &settings).unwrap().check().unwrap();
        }
        let file = fitted("[parameters]\nbrake-mps2 = { uniform = { min = -2.0, max = 6.0 } }\n");
        let message = file.settings(&headline()).unwrap_err().to_string();
        assert!(message.contains("`brake-mps2`: 25.") && message.contains("at most 10 % are cut"), "{message}");
    }
}

//! The values of parameters: a deterministic value set, and stochastic distributions.

use closecall_scenarios::ScenarioConfig;
use closecall_scenarios::parameters::{Distribution, EmpiricalConfig, LogNormalConfig, ParameterConfig};
use closecall_traffic::{ParameterName, Parameters, maths};

use super::element::Element;
use super::expression::parameter_name;
use super::scenario::header;

/// Returns the document with one value set for each sample, or `None` if there are no parameters.
pub(super) fn deterministic(scenario_file: &str, description: &str, samples: &[Parameters]) -> Option<String> {
    let sets: Vec<_> = samples.iter().filter(|sample| sample.iter().next().is_some()).map(value_set).collect();
    if sets.is_empty() {
        return None;
    }
    let sets = Element::new("ValueSetDistribution").children(sets);
    let inner = sets.within("DeterministicMultiParameterDistribution").within("Deterministic");
    Some(document(scenario_file, description, &[], inner))
}

fn value_set(sample: &Parameters) -> Element {
    Element::new("ParameterValueSet").children(sample.iter().map(|(name, value)| {
        Element::new("ParameterAssignment").with("parameterRef", parameter_name(name)).with("value", value)
    }))
}

/// Returns the document with the distribution of each parameter, or `None` if there are none.
pub(super) fn stochastic(
    scenario_file: &str,
    config: &ScenarioConfig,
    (description, unsaid): (&str, &[String]),
    (seed, samples): (u64, u64),
) -> Option<String> {
    if config.parameters.0.is_empty() {
        return None;
    }
    let distributions = config.parameters.0.iter().filter_map(|(name, config)| distribution(name, config));
    let inner =
        Element::new("Stochastic").with("numberOfTestRuns", samples).with("randomSeed", seed).children(distributions);
    Some(document(scenario_file, description, unsaid, inner))
}

fn document(scenario_file: &str, description: &str, unsaid: &[String], inner: Element) -> String {
    let values = Element::new("ParameterValueDistribution")
        .child(Element::new("ScenarioFile").with("filepath", scenario_file))
        .child(inner);
    Element::new("OpenSCENARIO").child(header(description, unsaid, None)).child(values).document()
}

fn distribution(name: &ParameterName, config: &ParameterConfig) -> Option<Element> {
    let inner = if let Some(uniform) = &config.uniform {
        Element::new("UniformDistribution").child(range(uniform.min, uniform.max))
    } else if let Some(normal) = &config.truncated_normal {
        Element::new("NormalDistribution")
            .with("expectedValue", normal.mean)
            .with("variance", normal.sd * normal.sd)
            .child(range(normal.min, normal.max))
    } else if let Some(log_normal) = &config.log_normal {
        log_normal_element(log_normal)?
    } else if let Some(empirical) = &config.empirical {
        histogram(empirical)
    } else if let Some(weights) = &config.choice {
        set(weights.iter().map(|(label, weight)| (label.clone(), *weight)))
    } else {
        set([(config.fixed.as_ref()?.to_string(), 1.0)])
    };
    Some(Element::new("StochasticDistribution").with("parameterName", parameter_name(name)).child(inner))
}

/// Returns a log-normal distribution. Its expected value and variance belong to the value itself
/// before truncation, and not to the logarithm: m·exp(σ²/2) and (exp(σ²) − 1)·exp(σ²)·m² for a
/// median m.
fn log_normal_element(config: &LogNormalConfig) -> Option<Element> {
    let spread = maths::exp_m1(config.sigma * config.sigma);
    let expected = config.median * (1.0 + spread).sqrt();
    let element = Element::new("LogNormalDistribution")
        .with("expectedValue", expected)
        .with("variance", spread * expected * expected);
    // A range has both limits. If one limit is open, its probability of 10⁻¹⁶ bounds the
    // distribution.
    let [low, high] = Distribution::log_normal(config).ok()?.bounds()?;
    let is_cut = config.min.is_some() || config.max.is_some();
    Some(element.children(is_cut.then(|| range(config.min.unwrap_or(low.min(0.0)), high))))
}

/// Returns a histogram whose bins, between the quantiles, have the same probability.
fn histogram(config: &EmpiricalConfig) -> Element {
    let bins =
        config.quantiles.windows(2).map(|pair| Element::new("Bin").with("weight", 1).child(range(pair[0], pair[1])));
    Element::new("Histogram").children(bins)
}

fn set(elements: impl IntoIterator<Item = (String, f64)>) -> Element {
    let elements =
        elements.into_iter().map(|(value, weight)| Element::new("Element").with("value", value).with("weight", weight));
    Element::new("ProbabilityDistributionSet").children(elements)
}

fn range(low: f64, high: f64) -> Element {
    Element::new("Range").with("lowerLimit", low).with("upperLimit", high)
}

//! Correlated parameters: their distributions stay, their ranks correlate, and wrong correlations are refused.

use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{ParameterName, Value};

use super::{ParameterSpace, ParametersConfig};
use crate::sampling::Design;
use closecall_recorded::criticality::spearman;

const INDEPENDENT: &str = "
    a = { uniform = { min = 0.0, max = 1.0 } }
    b = { empirical = { quantiles = [1.0, 2.0, 8.0, 20.0] } }
    c = { log-normal = { median = 2.0, sigma = 0.5 } }
    d = { choice = { x = 1, y = 1 } }
    e = { fixed = 3.0 }";

fn parsed(text: &str) -> Result<ParameterSpace, String> {
    let config: ParametersConfig = toml::from_str(text).map_err(|error| error.to_string())?;
    config.check().map_err(|error| error.to_string())
}

/// Adds rank correlations to `b`.
fn coupled(correlations: &str) -> Result<ParameterSpace, String> {
    parsed(&INDEPENDENT.replace("20.0] } }", &format!("20.0] }}, spearman = {{ {correlations} }} }}")))
}

fn column(space: &ParameterSpace, design: Design, name: &str) -> Vec<f64> {
    let name = ParameterName::new(name).unwrap();
    let values = (0..4_000).map(|index| match space.sample(design, 7, index, 4_000).get(&name) {
        Some(Value::Number(value)) => *value,
        other => panic!("{other:?}"),
    });
    values.collect()
}

#[test]
fn ranks_correlate_as_stated_and_each_distribution_stays() {
    let (space, free) = (coupled("a = 0.6, c = -0.4").unwrap(), parsed(INDEPENDENT).unwrap());
    for design in [Design::Random, Design::Sobol] {
        let [a, b, c] = ["a", "b", "c"].map(|name| column(&space, design, name));
        for (found, wanted) in [(spearman(&a, &b), 0.6), (spearman(&b, &c), -0.4), (spearman(&a, &c), 0.0)] {
            assert!((found.unwrap() - wanted).abs() < 0.04, "{design}: {found:?} instead of {wanted}");
        }
        let (own, others) = (median(c), median(column(&free, design, "c")));
        assert!((own / others - 1.0).abs() < 0.1, "{design}: {own} {others}");
    }
}

#[test]
fn parameters_that_state_no_correlation_keep_their_bits() {
    let (space, free) = (coupled("c = 0.9").unwrap(), parsed(INDEPENDENT).unwrap());
    for design in [Design::Random, Design::Sobol, Design::Grid] {
        for index in 0..50 {
            let (own, others) = (space.sample(design, 3, index, 50), free.sample(design, 3, index, 50));
            for name in ["a", "b", "d", "e"].map(|name| ParameterName::new(name).unwrap()) {
                assert_eq!(
                    own.get(&name),
                    others.get(&name),
                    "{design}: the first of the coupled ones keeps its number"
                );
            }
            assert_eq!(own == others, design == Design::Grid || own.get(&ParameterName::new("c").unwrap()).is_none());
        }
    }
}

#[test]
fn wrong_correlations_are_refused_with_what_is_allowed() {
    for (correlations, words) in [
        ("a = 1.0", "from -0.99 to 0.99"),
        ("a = nan", "finite"),
        ("z = 0.5", "a, b, c, d, e"),
        ("b = 0.5", "with itself"),
        ("d = 0.5", "`d` does not"),
        ("e = 0.5", "`e` does not"),
    ] {
        let message = coupled(correlations).unwrap_err();
        assert!(message.contains(words), "{correlations}: {message}");
    }
    let impossible = "
        a = { uniform = { min = 0.0, max = 1.0 }, spearman = { b = 0.9, c = 0.9 } }
        b = { uniform = { min = 0.0, max = 1.0 }, spearman = { c = -0.9 } }
        c = { uniform = { min = 0.0, max = 1.0 } }";
    assert!(parsed(impossible).unwrap_err().contains("no joint distribution"));
    let twice = impossible.replace("c = -0.9", "c = 0.7, a = 0.8");
    assert!(parsed(&twice).unwrap_err().contains("different rank correlations"));
}

//! Tests of reading, refusing and evaluating parameters.

use closecall_traffic::{ParameterName, Value, maths};
use proptest::prelude::*;

use super::*;

fn parsed(text: &str) -> ParametersConfig {
    toml::from_str(text).unwrap()
}

fn space(text: &str) -> ParameterSpace {
    parsed(text).check().unwrap()
}

fn distribution(text: &str) -> Distribution {
    let space = space(&format!("x = {{ {text} }}"));
    space.get(&ParameterName::new("x").unwrap()).unwrap().distribution.clone()
}

fn number(value: &Value) -> f64 {
    match value {
        Value::Number(number) => *number,
        Value::Label(label) => panic!("the label {label}"),
    }
}

/// Returns the error of a parameter `x` that can be parsed but is invalid.
fn refusal(text: &str) -> String {
    parsed(&format!("x = {{ {text} }}")).check().unwrap_err().to_string()
}

/// Returns the error of a parameter `x` that cannot be parsed.
fn unreadable(text: &str) -> String {
    toml::from_str::<ParametersConfig>(&format!("x = {{ {text} }}")).unwrap_err().to_string()
}

const ALL_KINDS: &str = r#"
brake-mps2    = { fixed = 6 }
cruise-mps    = { uniform = { min = 30, max = 33.2 }, assumed = "speeds of motorways", note = "cars" }
cut-out-thw-s = { empirical = { quantiles = [0.15, 0.19, 0.24, 0.31, 0.4] }, fitted = { n = 214, source = "US-101", interval-95 = [0.21, 0.27] } }
front-thw-s   = { truncated-normal = { mean = 0.7, sd = 0.15, min = 0.5, max = 0.9 } }
light         = { fixed = "dusk" }
reaction-s    = { log-normal = { median = 0.9, sigma = 0.3 } }
rear-class    = { choice = { car = 8, truck = 1, motorcycle = 1 } }
"#;

#[test]
fn every_kind_is_parsed_and_has_its_nominal_value() {
    let space = space(ALL_KINDS);
    let nominal: Vec<String> = space.nominal().iter().map(|(name, value)| format!("{name} {value:.3}")).collect();
    assert_eq!(
        nominal,
        [
            "brake-mps2 6",
            "cruise-mps 31.6",
            "cut-out-thw-s 0.24",
            "front-thw-s 0.7",
            "light dusk",
            "reaction-s 0.9",
            "rear-class car"
        ]
    );
}

#[test]
fn a_distribution_states_its_provenance() {
    let space = space(ALL_KINDS);
    let provenance = |name| space.get(&ParameterName::new(name).unwrap()).unwrap().provenance.clone();
    let fitted = FittedConfig {
        n: 214,
        source: "US-101".to_owned(),
        interval_95: Some([0.21, 0.27]),
        ..FittedConfig::default()
    };
    assert_eq!(provenance("cut-out-thw-s"), Provenance::Fitted(fitted));
    assert_eq!(provenance("cruise-mps"), Provenance::Assumed("speeds of motorways".to_owned()));
    assert_eq!(provenance("rear-class"), Provenance::Unstated);
}

#[test]
fn a_written_configuration_is_parsed_to_the_same_one() {
    let config = parsed(ALL_KINDS);
    assert_eq!(parsed(&toml::to_string(&config).unwrap()), config);
    let json = serde_json::to_string(&config).unwrap();
    assert_eq!(serde_json::from_str::<ParametersConfig>(&json).unwrap(), config);
}

#[test]
fn the_schema_describes_every_distribution() {
    let schema = schemars::schema_for!(ParametersConfig).to_value().to_string();
    for key in ["uniform", "truncated-normal", "log-normal", "choice", "empirical", "fixed", "fitted", "interval-95"] {
        assert!(schema.contains(&format!("\"{key}\"")), "{key} in {schema}");
    }
}

#[test]
fn non_finite_numbers_in_a_file_are_refused_with_value_and_line() {
    for (text, name) in [
        ("uniform = { min = nan, max = 1.0 }", "NaN"),
        ("uniform = { min = 0.0, max = inf }", "inf"),
        ("log-normal = { median = 1.0, sigma = 0.3, max = -inf }", "-inf"),
        ("empirical = { quantiles = [0.0, nan] }", "NaN"),
        ("choice = { a = 1.0, b = nan }", "NaN"),
        ("fixed = nan", "NaN"),
        ("fixed = 1.0, fitted = { n = 3, source = \"s\", interval-95 = [0.0, inf] }", "inf"),
    ] {
        let message = unreadable(text);
        assert!(message.contains(&format!("{name} is not allowed: a finite number is needed")), "{message}");
        assert!(message.contains("line 1"), "{message}");
    }
}

/// The same numbers, set by code instead of a file.
#[test]
fn non_finite_numbers_set_by_code_are_refused() {
    let nan = f64::NAN;
    for config in [
        ParameterConfig::uniform(nan, 1.0),
        ParameterConfig::uniform(0.0, nan),
        ParameterConfig::uniform(0.0, f64::INFINITY),
        ParameterConfig::empirical(vec![0.0, nan, 1.0]),
        ParameterConfig::empirical(vec![nan, 1.0]),
        ParameterConfig::fixed(Value::Number(nan)),
        ParameterConfig { choice: Some([("a".to_owned(), nan)].into()), ..ParameterConfig::default() },
        ParameterConfig {
            truncated_normal: Some(TruncatedNormalConfig { mean: nan, sd: 1.0, min: 0.0, max: 1.0 }),
            ..ParameterConfig::default()
        },
        ParameterConfig {
            log_normal: Some(LogNormalConfig { median: 1.0, sigma: nan, min: None, max: None }),
            ..ParameterConfig::default()
        },
    ] {
        assert!(config.check().is_err(), "{config:?}");
    }
}

#[test]
fn an_error_states_the_key_the_value_and_what_is_allowed() {
    for (text, message) in [
        (
            "note = \"none\"",
            "`x` is missing: a distribution, which is one of `uniform`, `truncated-normal`, `log-normal`, `choice`, \
             `empirical`, `fixed`",
        ),
        (
            "uniform = { min = 0, max = 1 }, fixed = 3",
            "`x.fixed` contradicts `uniform`: a parameter has exactly one distribution",
        ),
        (
            "uniform = { min = 2, max = 1 }",
            "`x.uniform.max` is 1, but a number above 2 and up to 1000000000000 is needed",
        ),
        (
            "uniform = { min = 2, max = 2 }",
            "`x.uniform.max` is 2, but a number above 2 and up to 1000000000000 is needed",
        ),
        (
            "truncated-normal = { mean = 0, sd = 0, min = 0, max = 1 }",
            "`x.truncated-normal.sd` is 0, but a number above 0 and up to 1000000000000 is needed",
        ),
        (
            "truncated-normal = { mean = 100, sd = 1, min = 0, max = 1 }",
            "`x.truncated-normal.mean` contradicts `min`: no probability is left between `min` and `max` (sd 1)",
        ),
        (
            "log-normal = { median = -1, sigma = 1 }",
            "`x.log-normal.median` is -1, but a number above 0 and up to 1000000000000 is needed",
        ),
        ("empirical = { quantiles = [1] }", "`x.empirical.quantiles` has 1 entry, but at least 2 are allowed"),
        (
            "empirical = { quantiles = [1, 3, 2] }",
            "`x.empirical.quantiles[2]` is 2, but a number from 3 to 1000000000000 is needed",
        ),
        ("choice = { a = 0.0, b = 0.0 }", "`x.choice` is missing: a label with a weight above 0"),
        ("choice = {}", "`x.choice` is missing: a label with a weight above 0"),
        ("choice = { a = -0.5, b = 1 }", "`x.choice.a` is -0.5, but a number from 0 to 1000000000000 is needed"),
        ("fixed = \" \"", "`x.fixed` is missing: a label that is not empty"),
        (
            "fixed = 1, assumed = \"why\", fitted = { n = 1, source = \"s\" }",
            "`x.assumed` contradicts `fitted`: a distribution is either fitted or assumed",
        ),
        ("fixed = 1, assumed = \"\"", "`x.assumed` is missing: the reason for the assumption"),
        ("fixed = 1, fitted = { n = 0, source = \"s\" }", "`x.fitted.n` is 0, but at least 1 observation is needed"),
        ("fixed = 1, fitted = { n = 1, source = \"\" }", "`x.fitted.source` is missing: what it was fitted to"),
        (
            "fixed = 1, fitted = { n = 1, source = \"s\", interval-95 = [2, 1] }",
            "`x.fitted.interval-95[1]` is 1, but a number from 2 to 1000000000000 is needed",
        ),
    ] {
        assert_eq!(refusal(text), message);
    }
}

#[test]
fn unknown_keys_and_wrong_types_are_refused_while_parsing() {
    for (text, message) in [
        ("unifrom = { min = 0, max = 1 }", "unknown field `unifrom`"),
        ("uniform = { min = 0, max = 1, mean = 0.5 }", "unknown field `mean`"),
        ("uniform = { min = 0 }", "missing field `max`"),
        ("uniform = { min = \"$other\", max = 1 }", "invalid type: string"),
        ("fixed = [1]", "expected a number or a label"),
        ("fixed = 1, fixed = 2", "duplicate key"),
    ] {
        let refusal = unreadable(text);
        assert!(refusal.contains(message), "{refusal}");
    }
    let capital = toml::from_str::<ParametersConfig>("Cruise = { fixed = 1 }").unwrap_err().to_string();
    assert!(capital.contains("`Cruise` is not a parameter's name"), "{capital}");
}

#[test]
fn labels_are_chosen_in_proportion_to_their_weights() {
    let choice = distribution("choice = { car = 8, motorcycle = 1, never = 0, truck = 1 }");
    let label = |u| choice.quantile(u).to_string();
    for (u, expected) in [
        (0.0, "car"),
        (0.799, "car"),
        (0.801, "motorcycle"),
        (0.899, "motorcycle"),
        (0.901, "truck"),
        (0.9999, "truck"),
    ] {
        assert_eq!(label(u), expected, "at {u}");
    }
    assert_eq!(choice.labels(), ["car", "motorcycle", "truck"]);
    assert_eq!(choice.bounds(), None);
    assert_eq!(choice.cdf(0.5), None);
}

/// Distribution, probability u, and quantile by bisection of the distribution function in mpmath
/// 1.3 with 250 digits.
const TAIL_REFERENCES: [(&str, f64, f64); 13] = [
    ("truncated-normal = { mean = 0, sd = 1, min = -8, max = 8 }", 1e-06, -4.753424308697181),
    ("truncated-normal = { mean = 0, sd = 1, min = -8, max = 8 }", 0.75, 0.6744897501960808),
    ("truncated-normal = { mean = 0, sd = 1, min = -40, max = 8 }", 1e-12, -7.034483825301132),
    ("truncated-normal = { mean = 0, sd = 1, min = 5, max = 6 }", 0.25, 5.054964580371361),
    ("truncated-normal = { mean = 0, sd = 1, min = 5, max = 6 }", 0.999, 5.958572650387236),
    ("truncated-normal = { mean = 0, sd = 1, min = -6, max = -5 }", 0.25, -5.259044729009616),
    ("truncated-normal = { mean = 10, sd = 2, min = 29, max = 60 }", 0.5, 29.143826842811496),
    ("truncated-normal = { mean = 0.7, sd = 0.15, min = 0.5, max = 0.9 }", 0.1, 0.558625363594638),
    ("truncated-normal = { mean = 0, sd = 1, min = 20, max = 30 }", 0.9, 20.114517324364595),
    ("log-normal = { median = 0.9, sigma = 0.3 }", 0.999, 2.274383840076649),
    ("log-normal = { median = 0.9, sigma = 0.3, max = 2.5 }", 0.999, 2.216665019758461),
    ("log-normal = { median = 0.9, sigma = 0.3, max = 0.3 }", 0.5, 0.28475401796200434),
    ("log-normal = { median = 0.9, sigma = 0.3 }", 1e-09, 0.14886690605697242),
];

#[test]
fn the_truncated_normal_is_exact_in_its_tails() {
    for (text, u, expected) in TAIL_REFERENCES {
        let value = number(&distribution(text).quantile(u));
        assert!((value / expected - 1.0).abs() < 2e-15, "{text} at {u}: {value}, not {expected}");
    }
}

#[test]
fn bounds_are_the_smallest_and_largest_values() {
    let bounds = |text| distribution(text).bounds().unwrap();
    assert_eq!(bounds("truncated-normal = { mean = 0.7, sd = 0.15, min = 0.5, max = 0.9 }"), [0.5, 0.9]);
    assert_eq!(bounds("fixed = 6"), [6.0, 6.0]);
    let [low, high] = bounds("log-normal = { median = 0.9, sigma = 0.3, max = 2.5 }");
    assert!(low > 0.0 && low < 0.9 * maths::exp(-8.0_f64 * 0.3) && (high - 2.5).abs() < 1e-12);
    let [_, unbounded] = bounds("log-normal = { median = 0.9, sigma = 0.3 }");
    assert!(unbounded > 9.0 && unbounded.is_finite());
}

#[test]
fn extremes_vary_one_parameter_at_a_time() {
    let space = space("a = { uniform = { min = 0, max = 1 } }\nb = { choice = { x = 2, y = 1 } }\nc = { fixed = 3 }");
    let shown: Vec<String> = space
        .extremes()
        .map(|parameters| parameters.iter().map(|(_, value)| format!("{value:.6}")).collect::<Vec<_>>().join(" "))
        .collect();
    assert_eq!(shown.len(), 4);
    assert_eq!(shown[0], "0.5 x 3");
    assert_eq!(shown[1], "0 x 3");
    assert_eq!(shown[3], "0.5 y 3");
}

fn any_distribution() -> impl Strategy<Value = Distribution> {
    let uniform = (-100.0..100.0, 0.01..100.0)
        .prop_map(|(min, span)| format!("uniform = {{ min = {min}, max = {} }}", min + span));
    let normal = (-5.0..5.0, 0.1..3.0, -8.0..8.0, 0.1..10.0).prop_map(|(mean, sd, min, span)| {
        format!("truncated-normal = {{ mean = {mean}, sd = {sd}, min = {min}, max = {} }}", min + span)
    });
    let log_normal = (0.1..10.0, 0.05..1.5, prop::option::of(0.5..20.0)).prop_map(|(median, sigma, max)| {
        let max = max.map_or(String::new(), |max: f64| format!(", max = {max}"));
        format!("log-normal = {{ median = {median}, sigma = {sigma}{max} }}")
    });
    let empirical = prop::collection::vec(-10.0..10.0, 2..12).prop_map(|mut quantiles: Vec<f64>| {
        quantiles.sort_by(f64::total_cmp);
        format!("empirical = {{ quantiles = {quantiles:?} }}")
    });
    prop_oneof![uniform, normal, log_normal, empirical].prop_filter_map("no probability left", |text| {
        let config = parsed(&format!("x = {{ {text} }}"));
        let space = config.check().ok()?;
        space.iter().next().map(|(_, entry)| entry.distribution.clone())
    })
}

proptest! {
    #[test]
    fn quantiles_ascend_within_the_bounds(distribution in any_distribution(), u in 0.0..1.0, v in 0.0..1.0) {
        let [min, max] = distribution.bounds().unwrap();
        let (low, high) = (number(&distribution.quantile(f64::min(u, v))), number(&distribution.quantile(f64::max(u, v))));
        prop_assert!(min <= low && low <= high && high <= max, "{min} {low} {high} {max}");
    }

    #[test]
    fn the_cdf_is_the_inverse_of_the_quantile(distribution in any_distribution(), u in 0.001..0.999) {
        let value = number(&distribution.quantile(u));
        let probability = distribution.cdf(value).unwrap();
        prop_assert!((probability - u).abs() < 1e-8, "{probability} at {value}");
        prop_assert!(distribution.cdf(f64::MAX).unwrap() > 1.0 - 1e-12);
        prop_assert_eq!(distribution.cdf(-f64::MAX).unwrap(), 0.0);
    }
}

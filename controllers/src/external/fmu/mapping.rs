//! The assignment of quantities to the variables of an FMU.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::description::{Causality, Description, Type, Variable};
use super::quantity::{Number, Quantity};
use crate::external::exchange::Setup;

/// The names of the variables of an FMU, if they differ from the names of the quantities.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct VariableTable {
    /// The source of an input or parameter of the FMU, by its name: the name of a quantity, or a
    /// number.
    #[serde(default)]
    pub inputs: BTreeMap<String, Given>,
    /// The outputs of the FMU that are `acceleration` and, if it has one, `state`.
    #[serde(default)]
    pub outputs: BTreeMap<String, String>,
}

/// The value that a variable receives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Given {
    /// A number that stays the same.
    Number(f64),
    /// A quantity, by its name.
    Quantity(String),
}

/// A variable that is set in each control step, or once.
#[derive(Clone, Debug)]
pub(super) struct Set {
    pub(super) name: String,
    pub(super) reference: u32,
    pub(super) of_type: Type,
    pub(super) quantity: Quantity,
}

/// A variable that is read after each control step.
#[derive(Clone, Debug)]
pub(super) struct Get {
    pub(super) name: String,
    pub(super) reference: u32,
    pub(super) of_type: Type,
}

/// The variables that are set and read.
#[derive(Clone, Debug)]
pub(super) struct Mapping {
    pub(super) parameters: Vec<Set>,
    pub(super) inputs: Vec<Set>,
    pub(super) acceleration: Get,
    pub(super) state: Option<Get>,
}

/// The outputs that a table can name.
const OUTPUTS: [&str; 2] = ["acceleration", "state"];

impl Mapping {
    /// Returns the mapping of an FMU, or its fault.
    pub(super) fn new(description: &Description, table: &VariableTable, setup: &Setup) -> Result<Self, String> {
        let with_causality =
            |causality| description.variables.iter().filter(move |variable| variable.causality == causality);
        let names =
            |causality| match with_causality(causality).map(|variable| variable.name.as_str()).collect::<Vec<_>>() {
                names if names.is_empty() => "none".to_owned(),
                names => names.join(", "),
            };
        let settable = |variable: &&Variable| matches!(variable.causality, Causality::Input | Causality::Parameter);
        for name in table.inputs.keys() {
            if !description.variables.iter().filter(settable).any(|variable| variable.name == *name) {
                let (inputs, parameters) = (names(Causality::Input), names(Causality::Parameter));
                return Err(format!(
                    "the table names the input `{name}`, which the FMU does not have; its inputs are {inputs}; its parameters are \
                     {parameters}"
                ));
            }
        }
        if let Some(unknown) = table.outputs.keys().find(|name| !OUTPUTS.contains(&name.as_str())) {
            return Err(format!("the table names the output `{unknown}`; expected acceleration or state"));
        }
        let mut mapping = Self {
            parameters: Vec::new(),
            inputs: Vec::new(),
            acceleration: Get { name: String::new(), reference: 0, of_type: Type::Other },
            state: None,
        };
        for variable in description.variables.iter().filter(settable) {
            let is_input = variable.causality == Causality::Input;
            let quantity = match table.inputs.get(&variable.name) {
                Some(Given::Number(value)) if !value.is_finite() => {
                    return Err(format!(
                        "the table gives `{}` the number {value}; expected a finite one",
                        variable.name
                    ));
                }
                Some(Given::Number(value)) => Quantity::Fixed { value: *value, unit: "", number: Number::Real },
                Some(Given::Quantity(name)) => Quantity::of(name, setup).ok_or_else(|| {
                    format!(
                        "the table gives `{}` the quantity `{name}`; there are {}",
                        variable.name,
                        Quantity::names()
                    )
                })?,
                None => match Quantity::of(&variable.name, setup) {
                    Some(quantity) => quantity,
                    // A parameter keeps its start value.
                    None if !is_input => continue,
                    None => {
                        return Err(format!(
                            "its input `{}` is not the name of a quantity, and the table of the scenario does not name it; there are \
                             {}",
                            variable.name,
                            Quantity::names()
                        ));
                    }
                },
            };
            if !is_input && !matches!(quantity, Quantity::Fixed { .. }) {
                return Err(format!(
                    "its parameter `{}` would change in each step: it must be an input",
                    variable.name
                ));
            }
            check(variable, &quantity)?;
            let (name, of_type) = (variable.name.clone(), variable.of_type);
            let set = Set { name, reference: variable.reference, of_type, quantity };
            if is_input { mapping.inputs.push(set) } else { mapping.parameters.push(set) }
        }
        for output in OUTPUTS {
            let name = table.outputs.get(output).map_or(output, String::as_str);
            let variable = with_causality(Causality::Output).find(|variable| variable.name == name);
            let is_named = table.outputs.contains_key(output);
            match variable {
                Some(variable) => {
                    let is_real = variable.of_type.is_real();
                    let is_whole = !matches!(variable.of_type, Type::Boolean | Type::Other) && !is_real;
                    if variable.is_array || !(if output == "acceleration" { is_real } else { is_whole }) {
                        let expected = if output == "acceleration" { "a real number" } else { "a whole number" };
                        return Err(format!(
                            "its output `{name}` has the type {}; expected {expected}",
                            variable.of_type
                        ));
                    }
                    let (reference, of_type) = (variable.reference, variable.of_type);
                    let get = Get { name: variable.name.clone(), reference, of_type };
                    if output == "acceleration" {
                        check_unit(variable, "m/s2")?;
                        mapping.acceleration = get;
                    } else {
                        mapping.state = Some(get);
                    }
                }
                None if is_named || output == "acceleration" => {
                    return Err(format!("it has no output `{name}`; its outputs are {}", names(Causality::Output)));
                }
                None => {}
            }
        }
        Ok(mapping)
    }
}

/// Checks that a variable can hold a quantity.
fn check(variable: &Variable, quantity: &Quantity) -> Result<(), String> {
    let (name, of_type) = (&variable.name, variable.of_type);
    if variable.is_array {
        return Err(format!("its variable `{name}` is an array; expected a single number"));
    }
    let fits = match (of_type, quantity.number()) {
        (Type::Other, _) => false,
        (Type::Float64 | Type::Float32, _) | (_, Number::Whole | Number::Truth) => true,
        (_, Number::Real) => match quantity {
            Quantity::Fixed { value, .. } => *value == value.trunc(),
            _ => false,
        },
    };
    if !fits {
        return Err(format!(
            "its variable `{name}` has the type {of_type}, which cannot hold the quantity; expected a real number"
        ));
    }
    check_unit(variable, quantity.unit())
}

/// Refuses a variable that states another unit. A variable without a unit counts as having the
/// right unit.
fn check_unit(variable: &Variable, expected: &str) -> Result<(), String> {
    let plain = |unit: &str| {
        unit.replace(['^', ' ', '(', ')', '*'], "").replace('²', "2").replace("s-1", "/s").replace("s-2", "/s2")
    };
    match &variable.unit {
        Some(unit) if !expected.is_empty() && plain(unit) != expected => {
            Err(format!("its variable `{}` has the unit `{unit}`; expected `{expected}`", variable.name))
        }
        _ => Ok(()),
    }
}

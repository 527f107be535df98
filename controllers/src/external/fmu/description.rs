//! The description of an FMU: `modelDescription.xml`.

use std::fmt;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// The version of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Version {
    Fmi2,
    Fmi3,
}

/// The causality of a variable, with the kinds that matter here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Causality {
    Input,
    Output,
    Parameter,
    Other,
}

/// The type of a variable. The names come from FMI 3.0; FMI 2.0 has `Real`, `Integer`, `Boolean`,
/// `String` and `Enumeration`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Float64,
    Float32,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Boolean,
    Enumeration,
    /// A type that no quantity has.
    Other,
}

impl Type {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "Real" | "Float64" => Self::Float64,
            "Float32" => Self::Float32,
            "Integer" | "Int32" => Self::Int32,
            "UInt32" => Self::UInt32,
            "Int64" => Self::Int64,
            "UInt64" => Self::UInt64,
            "Boolean" => Self::Boolean,
            "Enumeration" => Self::Enumeration,
            "String" | "Int8" | "UInt8" | "Int16" | "UInt16" | "Binary" | "Clock" => Self::Other,
            _ => return None,
        })
    }

    /// Returns true for floating-point numbers.
    pub(crate) const fn is_real(self) -> bool {
        matches!(self, Self::Float64 | Self::Float32)
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if *self == Self::Other { "another type" } else { return write!(f, "{self:?}") };
        f.write_str(name)
    }
}

/// A variable.
#[derive(Clone, Debug)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) reference: u32,
    pub(crate) causality: Causality,
    pub(crate) of_type: Type,
    pub(crate) unit: Option<String>,
    pub(crate) is_array: bool,
}

/// The content of the description.
#[derive(Clone, Debug)]
pub(crate) struct Description {
    pub(crate) version: Version,
    pub(crate) model: String,
    pub(crate) model_version: Option<String>,
    /// The GUID of FMI 2.0, or the instantiation token of FMI 3.0.
    pub(crate) token: String,
    /// The name of the binary.
    pub(crate) identifier: String,
    /// Whether a process can have one instance only.
    pub(crate) is_only_once: bool,
    /// The step that the FMU prescribes (s); `None` if it accepts any.
    pub(crate) fixed_step_s: Option<f64>,
    pub(crate) variables: Vec<Variable>,
}

/// Returns an attribute of an element.
fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let attribute = element.attributes().flatten().find(|attribute| attribute.key.as_ref() == name.as_bytes())?;
    let value = String::from_utf8(attribute.value.into_owned()).ok()?;
    quick_xml::escape::unescape(&value).ok().map(|value| value.into_owned())
}

fn is_true(element: &BytesStart<'_>, name: &str) -> bool {
    attribute(element, name).is_some_and(|value| value == "true" || value == "1")
}

/// The parts of a description while it is read.
#[derive(Default)]
struct Draft {
    version: Option<Version>,
    model: String,
    model_version: Option<String>,
    token: String,
    identifier: Option<String>,
    has_model_exchange: bool,
    is_only_once: bool,
    can_vary_step: bool,
    internal_step_s: Option<f64>,
    default_step_s: Option<f64>,
    is_in_variables: bool,
    variables: Vec<Variable>,
}

impl Description {
    /// Reads a description, or returns its fault.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let mut reader = Reader::from_str(text);
        let mut draft = Draft::default();
        loop {
            match reader.read_event() {
                Ok(Event::Start(element) | Event::Empty(element)) => draft.start(&element)?,
                Ok(Event::End(element)) if element.name().as_ref() == b"ModelVariables" => {
                    draft.is_in_variables = false
                }
                Ok(Event::Eof) => break,
                Ok(_) => {}
                Err(error) => return Err(format!("its description is not XML: {error}")),
            }
        }
        draft.finish()
    }
}

impl Draft {
    fn start(&mut self, element: &BytesStart<'_>) -> Result<(), String> {
        let name = String::from_utf8_lossy(element.name().as_ref()).into_owned();
        let number = |key: &str| attribute(element, key).and_then(|text| text.parse::<f64>().ok());
        match name.as_str() {
            "fmiModelDescription" => {
                let version = attribute(element, "fmiVersion").unwrap_or_default();
                self.version = match version.as_str() {
                    "2.0" => Some(Version::Fmi2),
                    three if three == "3.0" || three.starts_with("3.0.") => Some(Version::Fmi3),
                    _ => return Err(format!("it is an FMU of FMI version `{version}`; expected 2.0 or 3.0")),
                };
                self.model = attribute(element, "modelName").unwrap_or_default();
                self.model_version = attribute(element, "version");
                self.token =
                    attribute(element, "guid").or_else(|| attribute(element, "instantiationToken")).unwrap_or_default();
            }
            "ModelExchange" => self.has_model_exchange = true,
            "CoSimulation" => {
                self.identifier = attribute(element, "modelIdentifier");
                self.is_only_once = is_true(element, "canBeInstantiatedOnlyOncePerProcess");
                self.can_vary_step = is_true(element, "canHandleVariableCommunicationStepSize");
                self.internal_step_s = number("fixedInternalStepSize");
            }
            "DefaultExperiment" => self.default_step_s = number("stepSize"),
            "ModelVariables" => self.is_in_variables = true,
            "ScalarVariable" if self.is_in_variables => {
                let variable = Self::variable(element, Type::Other);
                self.variables.extend(variable);
            }
            "Dimension" if self.is_in_variables => {
                if let Some(last) = self.variables.last_mut() {
                    last.is_array = true;
                }
            }
            other if self.is_in_variables => {
                let Some(of_type) = Type::of(other) else { return Ok(()) };
                match (self.version, self.variables.last_mut()) {
                    // In FMI 2.0 the type is an element in the variable.
                    (Some(Version::Fmi2), Some(last)) => {
                        last.of_type = of_type;
                        last.unit = attribute(element, "unit");
                    }
                    _ => self.variables.extend(Self::variable(element, of_type)),
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn variable(element: &BytesStart<'_>, of_type: Type) -> Option<Variable> {
        let causality = match attribute(element, "causality").as_deref() {
            Some("input") => Causality::Input,
            Some("output") => Causality::Output,
            Some("parameter" | "structuralParameter") => Causality::Parameter,
            _ => Causality::Other,
        };
        Some(Variable {
            name: attribute(element, "name")?,
            reference: attribute(element, "valueReference")?.parse().ok()?,
            causality,
            of_type,
            unit: attribute(element, "unit"),
            is_array: false,
        })
    }

    fn finish(self) -> Result<Description, String> {
        let version = self.version.ok_or("its description has no element fmiModelDescription")?;
        let identifier = match (self.identifier, self.has_model_exchange) {
            (Some(identifier), _) => identifier,
            (None, true) => return Err("it is for model exchange only; expected an FMU for co-simulation".to_owned()),
            (None, false) => {
                return Err("its description has no element CoSimulation with a modelIdentifier".to_owned());
            }
        };
        // A step that may not vary is the step that the FMU proposes.
        let proposed_s = self.default_step_s.filter(|_| !self.can_vary_step);
        Ok(Description {
            version,
            model: self.model,
            model_version: self.model_version,
            token: self.token,
            identifier,
            is_only_once: self.is_only_once,
            fixed_step_s: self.internal_step_s.or(proposed_s),
            variables: self.variables,
        })
    }
}

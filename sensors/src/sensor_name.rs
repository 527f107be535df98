//! Names of sensors that a scenario can have more than once.

use closecall_traffic::{ConfigError, Problem, is_kebab_name};

use crate::kept::kept;

/// A checked sensor with a name.
pub(crate) trait Named: Copy {
    /// What the sensor is.
    const KIND: &'static str;

    /// Returns its name.
    fn name(&self) -> &'static str;
}

/// Returns the name that a scenario gives a sensor, or else its default name.
pub(crate) fn checked_name(
    name: Option<&String>,
    default_name: Option<&'static str>,
) -> Result<&'static str, ConfigError> {
    match (name, default_name) {
        (Some(name), _) if is_kebab_name(name) => Ok(kept(name)),
        (Some(name), _) => {
            let rule = format!("`{name}` is no name: it needs lower-case letters, digits and hyphens, a letter first");
            Err(ConfigError::new("name", Problem::Contradiction { other: "name", rule }))
        }
        (None, Some(name)) => Ok(name),
        (None, None) => {
            let needed = "each of several sensors needs a name, such as `name = \"left\"`";
            Err(ConfigError::new("name", Problem::Missing { needed }))
        }
    }
}

/// Checks the further sensors of a list with `check`. Their names must differ from `names` and from
/// each other. `key` is the key of the list, and `allowed` the number of its entries in words.
pub(crate) fn check_further<C, T: Named, const N: usize>(
    (key, allowed): (&str, &'static str),
    configs: &[C],
    mut names: Vec<&'static str>,
    check: impl Fn(&C) -> Result<T, ConfigError>,
) -> Result<[Option<T>; N], ConfigError> {
    if configs.len() > N {
        return Err(ConfigError::new(key, Problem::WrongLength { value: configs.len() as u64, allowed }));
    }
    let mut checked = [None; N];
    for (index, (slot, config)) in checked.iter_mut().zip(configs).enumerate() {
        let located = |error: ConfigError| error.within_index(index).within(key);
        let sensor = check(config).map_err(located)?;
        if names.contains(&sensor.name()) {
            return Err(located(same_name::<T>(sensor.name())));
        }
        names.push(sensor.name());
        *slot = Some(sensor);
    }
    Ok(checked)
}

/// Returns the error of a second sensor of the same name.
pub(crate) fn same_name<T: Named>(name: &str) -> ConfigError {
    let rule = format!("another {} is called `{name}`, too, and faults could not tell them apart", T::KIND);
    ConfigError::new("name", Problem::Contradiction { other: "name", rule })
}

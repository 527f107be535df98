//! The sectors in which a sensor sees nothing.

use closecall_traffic::{ConfigError, Num, Parameters, Problem, Range};

/// Maximum number of blocked sectors: one for each entry.
pub(super) const MAX_SECTORS: usize = 4;

/// The blocked sectors of a sensor, from the right to the left (deg).
pub(crate) type Sectors = [Option<[f64; 2]>; MAX_SECTORS];

/// Returns the blocked sectors of two faults that hold together.
pub(super) fn add_sectors(mut sectors: Sectors, others: Sectors) -> Sectors {
    let free = sectors.iter_mut().filter(|sector| sector.is_none());
    free.zip(others.into_iter().flatten()).for_each(|(slot, sector)| *slot = Some(sector));
    sectors
}

/// Checks the two ends of a blocked sector, each within `azimuth_deg`.
pub(super) fn check_sector(
    [from, to]: [&Option<Num>; 2],
    azimuth_deg: Range,
    parameters: &Parameters,
) -> Result<Sectors, ConfigError> {
    let sector = match (from, to) {
        (None, None) => None,
        (Some(from), Some(to)) => {
            let from = parameters.number(from, "blocked-from-deg", azimuth_deg)?;
            let to = parameters.number(to, "blocked-to-deg", azimuth_deg)?;
            if !(from < to) {
                let rule = "a sector ends farther left than it begins".to_owned();
                let problem = Problem::Contradiction { other: "blocked-from-deg", rule };
                return Err(ConfigError::new("blocked-to-deg", problem));
            }
            Some([from, to])
        }
        (from_deg, _) => {
            let key = if from_deg.is_none() { "blocked-from-deg" } else { "blocked-to-deg" };
            return Err(ConfigError::new(key, Problem::Missing { needed: "a blocked sector has two ends" }));
        }
    };
    let mut sectors = [None; MAX_SECTORS];
    sectors[0] = sector;
    Ok(sectors)
}

//! The conditions under which perception is studied: each differs from the usual one in one respect.

use closecall_sensors::faults::Faults;
use closecall_sensors::{SensorMode, Sensors};
use closecall_simulation::scenario::{ScenarioError, ScenarioFile, library};
use closecall_traffic::{BodyShape, Environment, Light, Plate, Road, VehicleClass};

/// Reflectivity of the usual paint (-).
pub const USUAL_PAINT: f64 = 0.5;
/// Reflectivities of paint, from black to white (-).
const PAINTS: [f64; 4] = [0.1, 0.2, 0.35, 0.8];
/// Rates of moderate and heavy rain (mm/h): the lower ends of the classes "strong" and "very strong" of the German Weather Service.
const RAIN_MM_PER_H: [f64; 2] = [10.0, 30.0];
/// Visibilities in fog (m).
const FOG_M: [f64; 2] = [200.0, 100.0];
/// Lateral offset of the neighbouring lane (m), and of a vehicle that straddles the marking.
const OFFSETS_M: [f64; 2] = [3.75, 1.9];

/// A condition.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// What is varied: `class`, `paint`, `plate`, `offset`, `weather`, `light`, `traffic` or `fault`.
    pub factor: &'static str,
    /// The condition, in words.
    pub name: String,
    /// Class of the vehicle that approaches.
    pub class: VehicleClass,
    /// Reflectivity of its paint (-).
    pub paint: f64,
    /// The state of its plate.
    pub plate: Plate,
    /// Its body shape; `None` for the first of its class.
    pub shape: Option<BodyShape>,
    /// Its lateral offset from the ego, positive to the left (m).
    pub offset_m: f64,
    /// Light and weather.
    pub environment: Environment,
    /// Whether another car drives 25 m behind the ego, in its lane.
    pub is_screened: bool,
    /// The faults of the sensors, which hold for the whole approach; `None` for those of the study.
    pub faults: Option<Faults>,
    /// Whether guard rails stand along the road, if the road of the study has none.
    pub has_guard_rails: bool,
}

impl Case {
    pub(crate) fn usual() -> Self {
        Self {
            factor: "usual",
            name: "usual: car, paint 0.5, own lane, clear day".to_owned(),
            class: VehicleClass::Car,
            paint: USUAL_PAINT,
            plate: Plate::Clean,
            shape: None,
            offset_m: 0.0,
            environment: Environment::CLEAR_DAY,
            is_screened: false,
            faults: None,
            has_guard_rails: false,
        }
    }

    fn of(factor: &'static str, name: String) -> Self {
        Self { factor, name, ..Self::usual() }
    }
}

/// Returns the cases, the usual one first. `mode` says which faults of the library apply.
///
/// # Errors
/// [`ScenarioError`] if a scenario of the library is broken.
pub fn cases(mode: SensorMode) -> Result<Vec<Case>, ScenarioError> {
    let mut cases = vec![Case::usual()];
    for class in [VehicleClass::Truck, VehicleClass::Motorcycle] {
        cases.push(Case { class, ..Case::of("class", class.name().to_owned()) });
    }
    for paint in PAINTS {
        cases.push(Case { paint, ..Case::of("paint", format!("paint {paint}")) });
    }
    for (plate, name) in [(Plate::Dirty, "dirty"), (Plate::None, "none")] {
        cases.push(Case { plate, paint: PAINTS[0], ..Case::of("plate", format!("paint {}, plate {name}", PAINTS[0])) });
    }
    for offset_m in OFFSETS_M {
        cases.push(Case { offset_m, ..Case::of("offset", format!("{offset_m} m to the left")) });
    }
    for rain_mm_per_h in RAIN_MM_PER_H {
        let environment = Environment { rain_mm_per_h, ..Environment::CLEAR_DAY };
        cases.push(Case { environment, ..Case::of("weather", format!("rain {rain_mm_per_h} mm/h")) });
    }
    for visibility_m in FOG_M {
        let environment = Environment { visibility_m, ..Environment::CLEAR_DAY };
        cases.push(Case { environment, ..Case::of("weather", format!("fog, visibility {visibility_m} m")) });
    }
    for (light, name) in [(Light::Dusk, "dusk"), (Light::Night, "night")] {
        let environment = Environment { light, ..Environment::CLEAR_DAY };
        cases.push(Case { environment, ..Case::of("light", name.to_owned()) });
    }
    for (offset_m, name) in [(0.0, "car 25 m behind, in line"), (1.9, "car 25 m behind, 1.9 m aside")] {
        cases.push(Case { is_screened: true, offset_m, ..Case::of("traffic", name.to_owned()) });
    }
    cases.extend(faults(mode)?);
    Ok(cases)
}

/// Returns a case for each scenario of the library in which a rear sensor of this mode, the odometry or the map has a fault. Of the
/// scenario come the fault and what it needs: the light and the guard rails. The sensors are those of the study.
///
/// # Errors
/// [`ScenarioError`] if a scenario of the library is broken: its fault would silently be missing.
fn faults(mode: SensorMode) -> Result<Vec<Case>, ScenarioError> {
    let mut cases = Vec::new();
    for name in library::names() {
        let text = library::text(name).unwrap_or_default();
        let file = ScenarioFile::parse(&library::path(name), text, &[])?;
        if !file.config().tags.iter().any(|tag| tag == "fault") {
            continue;
        }
        let scenario = file.concrete(&file.space().nominal())?;
        let faults = scenario.sensors.faults();
        if faults.concern_odometry_only() || faults.concern_rear() && scenario.sensors.mode() == mode {
            cases.push(Case {
                faults: Some(faults.throughout()),
                environment: Environment { light: scenario.environment.light, ..Environment::CLEAR_DAY },
                has_guard_rails: scenario.road.has_guard_rails(),
                ..Case::of("fault", format!("fault: {name}"))
            });
        }
    }
    Ok(cases)
}

impl Case {
    /// Returns the sensors of the study with the faults of this case.
    pub(crate) fn sensors(&self, studied: &Sensors) -> Sensors {
        self.faults.map_or(*studied, |faults| studied.with_faults(faults))
    }

    /// Returns the road of the study with the guard rails of this case.
    pub(crate) fn road(&self, studied: &Road) -> Road {
        if self.has_guard_rails { studied.with_guard_rails() } else { *studied }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_one_of_the_studied_sensors_and_holds_for_the_whole_approach() {
        let sensors = |settings: &[&str]| {
            let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
            let text = library::text("low-thw-overtake").unwrap();
            let file = ScenarioFile::parse(&library::path("low-thw-overtake"), text, &settings).unwrap();
            file.concrete(&file.space().nominal()).unwrap().sensors
        };
        let (stock, own) = (sensors(&[]), sensors(&["sensors.rear-lidar.nominal-range-m=60.0"]));
        let cases = cases(SensorMode::Full).unwrap();
        let faulty: Vec<&Case> = cases.iter().filter(|case| case.factor == "fault").collect();
        // Those of the rear LiDAR and camera, of odometry and map, and no others.
        let names: Vec<&str> = faulty.iter().filter_map(|case| case.name.strip_prefix("fault: ")).collect();
        let expected: Vec<&str> = library::names()
            .filter(|name| ["camera-", "lidar-", "map-", "odometry-"].iter().any(|start| name.starts_with(start)))
            .filter(|name| library::text(name).unwrap().contains("\"fault\""))
            .collect();
        assert!(names == expected && names.len() >= 30, "{names:?} {expected:?}");
        for case in faulty {
            let sensors = case.sensors(&own);
            assert_eq!(sensors.with_faults(Faults::default()), own, "{}", case.name);
            assert_ne!(sensors, own, "{}", case.name);
            assert_ne!(sensors, case.sensors(&stock), "{}", case.name);
            let faults = *sensors.faults();
            assert_eq!(faults, faults.throughout(), "{}", case.name);
        }
        let road = Road::straight(3);
        let with_rails: Vec<&str> =
            cases.iter().filter(|case| case.road(&road).has_guard_rails()).map(|case| &*case.name).collect();
        assert_eq!(with_rails, ["fault: lidar-rail-ghosts", "fault: map-without-rails"]);
    }

    #[test]
    fn each_fault_of_the_object_level_rear_sensor_is_a_case_of_its_mode() {
        let cases = cases(SensorMode::Object).unwrap();
        let names: Vec<&str> = cases.iter().filter_map(|case| case.name.strip_prefix("fault: ")).collect();
        let is_expected = |name: &&str| {
            ["object-", "odometry-"].iter().any(|start| name.starts_with(start)) || name.starts_with("map-")
        };
        let expected: Vec<&str> =
            library::names().filter(is_expected).filter(|name| *name != "map-without-rails").collect();
        assert_eq!(names, expected);
    }
}

//! The conditions under which perception is studied: each differs from the usual one in one
//! respect.
//!
//! The usual condition has the light, the weather and the road of the scenario whose sensors are
//! studied.

use closecall_scenarios::{ScenarioError, ScenarioFile, library};
use closecall_sensors::camera::Sun;
use closecall_sensors::faults::Faults;
use closecall_sensors::{SensorMode, Sensors};
use closecall_traffic::{BodyShape, Environment, Lane, Light, Plate, Road, Side, VehicleClass};

/// Reflectivity of the usual paint (-).
pub const USUAL_PAINT: f64 = 0.5;
/// Reflectivities of paint, from black to white (-).
const PAINTS: [f64; 4] = [0.1, 0.2, 0.35, 0.8];
/// Rates of moderate and heavy rain (mm/h): the lower ends of the classes "strong" and "very
/// strong" of the German Weather Service.
const RAIN_MM_PER_H: [f64; 2] = [10.0, 30.0];
/// Visibilities in fog (m).
const FOG_M: [f64; 2] = [200.0, 100.0];
/// Offset of the car in between in the second case of traffic (m): half of a lane of 3.75 m.
const ASIDE_M: f64 = 1.9;

/// A condition.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The varied condition: `class`, `paint`, `plate`, `offset`, `weather`, `light`, `traffic` or
    /// `fault`.
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
    /// The pitch of the ego, positive nose down (rad).
    pub ego_pitch_rad: f64,
    /// Light and weather.
    pub environment: Environment,
    /// Whether another car drives 25 m behind the ego, in its lane.
    pub is_screened: bool,
    /// The faults of the sensors, which hold for the whole approach; `None` for the faults of the
    /// study.
    pub faults: Option<Faults>,
    /// The position of the sun, if the fault needs it; `None` for the position of the study.
    pub sun: Option<Sun>,
    /// Whether guard rails stand along the road, if the road of the study has none.
    pub has_guard_rails: bool,
}

impl Case {
    /// Returns the usual condition on a clear day.
    pub(crate) fn usual() -> Self {
        Self::usual_in(&Environment::CLEAR_DAY)
    }

    /// Returns the usual condition in this light and weather.
    fn usual_in(environment: &Environment) -> Self {
        Self {
            factor: "usual",
            name: format!("usual: car, paint {USUAL_PAINT}, own lane, {}", described(environment)),
            class: VehicleClass::Car,
            paint: USUAL_PAINT,
            plate: Plate::Clean,
            shape: None,
            offset_m: 0.0,
            ego_pitch_rad: 0.0,
            environment: *environment,
            is_screened: false,
            faults: None,
            sun: None,
            has_guard_rails: false,
        }
    }

    /// Returns this condition with another name, to be varied.
    fn varied(&self, factor: &'static str, name: String) -> Self {
        Self { factor, name, ..self.clone() }
    }
}

/// Returns light and weather in words.
fn described(environment: &Environment) -> String {
    let light = named(environment.light);
    let Environment { visibility_m, rain_mm_per_h, water_film_mm, .. } = *environment;
    let weather: Vec<String> = [
        (rain_mm_per_h > 0.0, format!("rain {rain_mm_per_h} mm/h")),
        (visibility_m < Environment::CLEAR_DAY.visibility_m, format!("visibility {visibility_m} m")),
        (water_film_mm > 0.0, format!("water film {water_film_mm} mm")),
    ]
    .into_iter()
    .filter_map(|(is_so, text)| is_so.then_some(text))
    .collect();
    if weather.is_empty() { format!("clear {light}") } else { format!("{light}, {}", weather.join(", ")) }
}

fn named(light: Light) -> &'static str {
    match light {
        Light::Day => "day",
        Light::Dusk => "dusk",
        Light::Night => "night",
    }
}

/// Returns the cases. The usual case comes first: it has the scenario's light, weather and road,
/// and each other case differs from it in one respect. `mode` determines the faults of the library
/// that apply.
///
/// # Errors
/// [`ScenarioError`] if a scenario of the library is broken.
pub fn cases(mode: SensorMode, environment: &Environment, road: &Road) -> Result<Vec<Case>, ScenarioError> {
    let usual = Case::usual_in(environment);
    let mut cases = vec![usual.clone()];
    for class in [VehicleClass::Truck, VehicleClass::Motorcycle] {
        cases.push(Case { class, ..usual.varied("class", class.name().to_owned()) });
    }
    for paint in PAINTS {
        cases.push(Case { paint, ..usual.varied("paint", format!("paint {paint}")) });
    }
    for (plate, name) in [(Plate::Dirty, "dirty"), (Plate::None, "none")] {
        cases.push(Case {
            plate,
            paint: PAINTS[0],
            ..usual.varied("plate", format!("paint {}, plate {name}", PAINTS[0]))
        });
    }
    cases.extend(offsets(&usual, road));
    cases.extend(weathers(&usual));
    for light in [Light::Day, Light::Dusk, Light::Night].into_iter().filter(|light| *light != environment.light) {
        let environment = Environment { light, ..*environment };
        cases.push(Case { environment, ..usual.varied("light", named(light).to_owned()) });
    }
    for (offset_m, name) in
        [(0.0, "car 25 m behind, in line".to_owned()), (ASIDE_M, format!("car 25 m behind, {ASIDE_M} m aside"))]
    {
        cases.push(Case { is_screened: true, offset_m, ..usual.varied("traffic", name) });
    }
    cases.extend(faults(mode, &usual)?);
    Ok(cases)
}

/// Returns a case for each lane beside the ego's lane, and for each of its markings.
fn offsets(usual: &Case, road: &Road) -> impl Iterator<Item = Case> {
    let ego_lane = ego_lane(road);
    let sides = [(1.0, Side::Left, "left"), (-1.0, Side::Right, "right")];
    let own_m = road.lane_width_m(ego_lane, 0.0);
    let beside = sides.into_iter().filter_map(move |(sign, side, name)| {
        let lane = road.beside(ego_lane, side)?;
        Some((sign, 0.5 * (own_m + road.lane_width_m(lane, 0.0)), name))
    });
    beside.flat_map(move |(sign, lane_m, name)| {
        [lane_m, 0.5 * own_m].map(|offset_m| {
            let offset_m = sign * offset_m;
            Case { offset_m, ..usual.varied("offset", format!("{} m to the {name}", offset_m.abs())) }
        })
    })
}

/// Returns the cases of other weather. The weather of the usual condition is not repeated.
fn weathers(usual: &Case) -> impl Iterator<Item = Case> {
    let here = usual.environment;
    let clear = Environment { light: here.light, friction: here.friction, ..Environment::CLEAR_DAY };
    let rain = RAIN_MM_PER_H
        .map(|rain_mm_per_h| (Environment { rain_mm_per_h, ..here }, format!("rain {rain_mm_per_h} mm/h")));
    let fog =
        FOG_M.map(|visibility_m| (Environment { visibility_m, ..here }, format!("fog, visibility {visibility_m} m")));
    let all = [(clear, "clear air, dry road".to_owned())].into_iter().chain(rain).chain(fog);
    all.filter(move |(environment, _)| *environment != here)
        .map(move |(environment, name)| Case { environment, ..usual.varied("weather", name) })
}

/// Returns the lane in which the ego drives: the second from the left, or the only one.
pub(crate) fn ego_lane(road: &Road) -> Lane {
    Lane(road.lanes().min(2))
}

/// Returns a case for each scenario of the library in which a rear sensor of this mode, the
/// odometry or the map has a fault. The case takes from that scenario the fault and its
/// requirements: the guard rails, and for glare the position of the sun, the light and the air. The
/// sensors are the sensors of the study.
///
/// # Errors
/// [`ScenarioError`] if a scenario of the library is broken: its fault would silently be missing.
fn faults(mode: SensorMode, usual: &Case) -> Result<Vec<Case>, ScenarioError> {
    let mut cases = Vec::new();
    for name in library::names() {
        let text = library::text(name).unwrap_or_default();
        let file = ScenarioFile::parse(&library::path(name), text, &[])?;
        if !file.config().tags.iter().any(|tag| tag == "fault") {
            continue;
        }
        let scenario = file.concrete(&file.space().nominal())?;
        let faults = scenario.sensors.faults();
        if !(faults.concern_odometry_only() || faults.concern_rear() && scenario.sensors.mode() == mode) {
            continue;
        }
        let mut of_camera = file.config().fault.rear_camera.iter();
        let is_glare = of_camera.any(|fault| fault.sun_glare.is_some() || fault.main_beam_glare.is_some());
        let environment = if is_glare { scenario.environment } else { usual.environment };
        let elsewhere =
            if environment == usual.environment { String::new() } else { format!(", {}", described(&environment)) };
        cases.push(Case {
            faults: Some(faults.throughout()),
            sun: is_glare.then(|| scenario.sensors.camera().sun),
            environment,
            has_guard_rails: scenario.road.has_guard_rails(),
            ..usual.varied("fault", format!("fault: {name}{elsewhere}"))
        });
    }
    Ok(cases)
}

impl Case {
    /// Returns the sensors of the study with the faults of this case.
    pub(crate) fn sensors(&self, studied: &Sensors) -> Sensors {
        let studied = self.sun.map_or(*studied, |sun| studied.with_sun(sun));
        self.faults.map_or(studied, |faults| studied.with_faults(faults))
    }

    /// Returns the road of the study with the guard rails of this case.
    pub(crate) fn road(&self, studied: &Road) -> Road {
        if self.has_guard_rails { studied.with_guard_rails() } else { studied.clone() }
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
        let (stock, studied) = (sensors(&[]), sensors(&["sensors.rear-lidar.nominal-range-m=60.0"]));
        let road = Road::straight(3);
        let cases = cases(SensorMode::Full, &Environment::CLEAR_DAY, &road).unwrap();
        let faulty: Vec<&Case> = cases.iter().filter(|case| case.factor == "fault").collect();
        // Only faults of the rear LiDAR and camera, of odometry and map.
        let names: Vec<&str> = faulty
            .iter()
            .filter_map(|case| case.name.strip_prefix("fault: "))
            .map(|name| name.split(',').next().unwrap())
            .collect();
        let expected: Vec<&str> = library::names()
            .filter(|name| ["camera-", "lidar-", "map-", "odometry-"].iter().any(|start| name.starts_with(start)))
            .filter(|name| library::text(name).unwrap().contains("\"fault\""))
            .collect();
        assert!(names == expected && names.len() >= 30, "{names:?} {expected:?}");
        for case in faulty {
            let sensors = case.sensors(&studied);
            let faultless = sensors.with_faults(Faults::default()).with_sun(studied.camera().sun);
            assert_eq!(faultless, studied, "{}", case.name);
            assert_ne!(sensors, studied, "{}", case.name);
            assert_ne!(sensors, case.sensors(&stock), "{}", case.name);
            let faults = *sensors.faults();
            assert_eq!(faults, faults.throughout(), "{}", case.name);
        }
        let with_rails: Vec<&str> =
            cases.iter().filter(|case| case.road(&road).has_guard_rails()).map(|case| &*case.name).collect();
        assert_eq!(with_rails, ["fault: lidar-rail-ghosts", "fault: map-without-rails"]);
    }

    #[test]
    fn each_fault_of_the_object_level_rear_sensor_is_a_case_of_its_mode() {
        let cases = cases(SensorMode::Object, &Environment::CLEAR_DAY, &Road::straight(3)).unwrap();
        let names: Vec<&str> = cases
            .iter()
            .filter_map(|case| case.name.strip_prefix("fault: "))
            .map(|name| name.split(',').next().unwrap())
            .collect();
        let is_expected = |name: &&str| {
            ["object-", "odometry-"].iter().any(|start| name.starts_with(start)) || name.starts_with("map-")
        };
        let expected: Vec<&str> =
            library::names().filter(is_expected).filter(|name| *name != "map-without-rails").collect();
        assert_eq!(names, expected);
    }

    fn names_of<'a>(cases: &'a [Case], factor: &str) -> Vec<&'a str> {
        cases.iter().filter(|case| case.factor == factor).map(|case| &*case.name).collect()
    }

    #[test]
    fn each_case_differs_from_the_light_and_weather_of_the_scenario_in_one_respect() {
        let foggy = Environment { light: Light::Night, visibility_m: 100.0, ..Environment::CLEAR_DAY };
        let cases = cases(SensorMode::Full, &foggy, &Road::straight(3)).unwrap();
        assert_eq!(cases[0].name, "usual: car, paint 0.5, own lane, night, visibility 100 m");
        for case in &cases {
            let other = Environment { light: foggy.light, ..case.environment };
            match case.factor {
                "weather" => assert_eq!(case.environment.light, Light::Night, "{}", case.name),
                "light" => assert_eq!(other, foggy, "{}", case.name),
                "fault" if case.sun.is_some() => {}
                _ => assert_eq!(case.environment, foggy, "{}", case.name),
            }
        }
        let weathers = ["clear air, dry road", "rain 10 mm/h", "rain 30 mm/h", "fog, visibility 200 m"];
        assert_eq!(names_of(&cases, "weather"), weathers);
        assert_eq!(names_of(&cases, "light"), ["day", "dusk"]);
        assert!(names_of(&cases, "fault").contains(&"fault: camera-low-sun, clear day"));
    }

    #[test]
    fn a_vehicle_is_offset_to_the_sides_on_which_there_is_a_lane() {
        let on = |lanes| {
            let cases = cases(SensorMode::Object, &Environment::CLEAR_DAY, &Road::straight(lanes)).unwrap();
            cases.iter().filter(|case| case.factor == "offset").map(|case| case.offset_m).collect::<Vec<f64>>()
        };
        assert_eq!(on(3), [3.75, 1.875, -3.75, -1.875]);
        assert_eq!(on(2), [3.75, 1.875]);
        assert!(on(1).is_empty());
    }
}

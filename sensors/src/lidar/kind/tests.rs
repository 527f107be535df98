use super::*;

fn checked(change: impl Fn(&mut LidarKindConfig)) -> Result<&'static LidarKind, String> {
    let mut config = LidarKindConfig::parse(LidarModel::Scala2.file()).unwrap();
    change(&mut config);
    config.kind().map_err(|error| error.to_string())
}

#[test]
fn every_shipped_file_is_read_and_the_same_file_is_the_same_kind() {
    for model in LidarModel::ALL {
        let config = LidarKindConfig::parse(model.file()).unwrap();
        assert!(std::ptr::eq(config.kind().unwrap(), model.kind()), "{}", config.name);
        assert!(config.source.len() > 40);
        let word = serde_json::to_value(model).unwrap();
        assert_eq!(word, config.name.as_str());
    }
}

#[test]
fn the_scala_keeps_the_numbers_of_the_model() {
    let kind = LidarModel::Scala2.kind();
    assert_eq!((kind.beams(), kind.layers(), kind.groups()), (10_448, 16, 4));
    assert_eq!(kind.nominal_range_m.to_bits(), 200.0_f64.to_bits());
    assert_eq!(kind.half_field_tan.to_bits(), 2.2998_f64.to_bits());
    assert_eq!(kind.sweep_ns.to_bits(), (40e6_f64 * 66.5 / 180.0).to_bits());
    for angle_rad in [kind.resolution.layer_rad, kind.resolution.footprint_rad[1]] {
        assert_eq!(angle_rad.to_bits(), (0.6 * (std::f64::consts::PI / 180.0)).to_bits());
    }
    assert!((0..100).all(|step| kind.is_due(Time::from_ns(step * CONTROL_STEP.ns()))));
}

#[test]
fn a_rate_of_10_hz_gives_10_scans_in_a_second() {
    let kind = LidarModel::Os1With64.kind();
    let due = (-25..0).filter(|step| kind.is_due(Time::from_ns(step * CONTROL_STEP.ns()))).count();
    assert_eq!(due, 10);
    // 40 m at 10 % with probability 0.9: P = 1 + 1.2816/5, so that the nominal range is
    // 40·√(1.2563·5) m.
    assert!((kind.nominal_range_m - 100.25).abs() < 0.01, "{}", kind.nominal_range_m);
}

#[test]
fn a_pattern_has_up_to_128_layers() {
    let kind = LidarModel::Os1With128.kind();
    // 2 · 189 + 1 columns.
    assert_eq!((kind.layers(), kind.beams()), (128, 379 * 128));
    let too_many = |config: &mut LidarKindConfig| {
        config.layers_per_group = None;
        config.layers_deg = (0..129).map(|layer| 0.1 * f64::from(layer)).collect();
    };
    let error = checked(too_many).unwrap_err();
    assert_eq!(error, "`layers-deg` has 129 entries, but 1 to 128 are allowed");
}

#[test]
fn the_sides_of_a_mirror_alternate_from_scan_to_scan_at_every_rate() {
    for rate_hz in [25.0, 20.0, 12.5, 10.0, 3.0] {
        let kind = checked(|config| config.rate_hz = rate_hz).unwrap();
        let times = (-50..200).map(|step| CONTROL_STEP * step).filter(|time| kind.is_due(*time));
        let sides: Vec<_> = times.map(|time| kind.mirror_side_at(time)).collect();
        assert!(sides.len() > 20 && sides.windows(2).all(|pair| pair[0] != pair[1]), "{rate_hz} Hz: {sides:?}");
    }
}

#[test]
fn the_processing_knows_how_far_and_how_high_a_kind_sees() {
    let seen = |model: LidarModel| {
        let lidar = super::super::Lidar {
            kind: model.kind(),
            nominal_range_m: model.kind().nominal_range_m,
            ..Default::default()
        };
        (lidar.reach_m(), model.kind().resolution.highest_tan)
    };
    let (reach_m, highest_tan) = seen(LidarModel::Scala2);
    assert_eq!((reach_m.to_bits(), highest_tan.to_bits()), (200.0_f64.to_bits(), 0.085_f64.to_bits()));
    // 16.6° and 15° with half a footprint; nothing is reported beyond 120 m.
    let (reach_m, highest_tan) = seen(LidarModel::Os1With64);
    assert!((reach_m - 100.25).abs() < 0.01 && (highest_tan - 0.299).abs() < 1e-9, "{reach_m} {highest_tan}");
    let (reach_m, highest_tan) = seen(LidarModel::PandarXt16);
    assert!((reach_m - 120.0).abs() < 1e-9 && (highest_tan - 0.270).abs() < 1e-9, "{reach_m} {highest_tan}");
}

#[test]
fn the_processing_knows_points_beams_and_ground_of_a_kind() {
    use super::super::Lidar;
    use super::super::ground::ground_reach_m;
    use super::super::rail_returns::narrow_to_m;
    let lidar = |kind: &'static LidarKind| Lidar { kind, nominal_range_m: kind.nominal_range_m, ..Lidar::default() };
    let derived = |kind: &'static LidarKind| {
        (kind.resolution.point_sd_m, narrow_to_m(kind.beam_height_deg), ground_reach_m(&lidar(kind)))
    };
    let (point_sd_m, narrow_m, ground_m) = derived(LidarModel::Scala2.kind());
    assert_eq!(
        (point_sd_m.to_bits(), narrow_m.to_bits(), ground_m.to_bits()),
        (0.05_f64.to_bits(), 30.0_f32.to_bits(), 40.0_f32.to_bits())
    );
    assert_eq!(Resolution::default().ground_reach_m, ground_m, "also for a scan about which nothing else is said");
    // √(0.015² + (0.237/2.25)²) m; 0.44 m over the tangent of 4/3 of 0.13°, down to tens of metres.
    assert_eq!(derived(LidarModel::Os1With64.kind()), (0.1064, 140.0, 40.0));
    assert_eq!(derived(LidarModel::PandarXt16.kind()), (0.0167, 100.0, 40.0));
    // A beam of 3° is as high as a rail's lower edge at 6 m: no distance is safe.
    assert_eq!(narrow_to_m(3.0), 0.0);
    let strong = checked(|config| (config.range_m, config.range_reflectivity) = (450.0, 0.5)).unwrap();
    let (_, _, strong_m) = derived(strong);
    assert!((45.0..60.0).contains(&strong_m), "{strong_m}");
    let high_m = ground_reach_m(&Lidar { mount_height_m: 2.5, ..lidar(strong) });
    assert!((70.0..95.0).contains(&high_m), "{high_m}");
    assert_eq!(ground_reach_m(&lidar(strong).exact()), 40.0);
}

#[test]
fn a_wrong_value_is_answered_with_key_and_allowed_range() {
    let error = checked(|config| config.rate_hz = 30.0).unwrap_err();
    assert_eq!(error, "`rate-hz` is 30, but a number from 1 to 25 is needed");
    let error = checked(|config| config.half_field_deg = 66.6).unwrap_err();
    assert!(error.starts_with("`half-field-deg` contradicts `azimuth-step-deg`: "), "{error}");
    let error = checked(|config| config.layers_deg.swap(3, 4)).unwrap_err();
    assert!(error.starts_with("`layers-deg[4]` is") && error.contains("above -2.185"), "{error}");
    let error = checked(|config| config.layers_deg[0] = f64::NAN).unwrap_err();
    assert_eq!(error, "`layers-deg[0]` is NaN, but a number from -45 to 45 is needed");
    let error = checked(|config| config.layers_per_group = Some(5)).unwrap_err();
    assert!(error.contains("1 to 4 groups"), "{error}");
    let error = checked(|config| config.layers_deg = Vec::new()).unwrap_err();
    assert!(error.contains("1 to 128"), "{error}");
    let error = checked(|config| config.range_probability = f64::NAN).unwrap_err();
    assert!(error.contains("from 0.5 to 0.99"), "{error}");
    let far = |config: &mut LidarKindConfig| (config.range_m, config.range_reflectivity) = (500.0, 0.01);
    let error = checked(far).unwrap_err();
    assert!(
        error.starts_with("`range-m` contradicts `range-reflectivity`: ") && error.contains("10 to 500"),
        "{error}"
    );
    let narrow = |config: &mut LidarKindConfig| {
        (config.azimuth_step_deg, config.fine_half_field_deg, config.fine_azimuth_step_deg) = (0.02, None, None);
    };
    assert!(checked(narrow).unwrap_err().contains("65,535"));
}

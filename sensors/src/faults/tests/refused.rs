//! Entries that are refused.

use super::*;

#[test]
fn entries_that_cannot_be_right_are_refused_by_their_keys() {
    let refused = |text: &str| faults(text).unwrap_err();
    for (text, key, why) in [
        ("[[rear-lidar]]\nfrom-s = 1.0", "rear-lidar[0].dead", "an effect of the fault"),
        (
            "[[rear-lidar]]\ndead = true\nfrom-s = 3.0\nuntil-s = 2.0",
            "rear-lidar[0].until-s",
            "ends after it has begun",
        ),
        ("[[rear-lidar]]\nblocked-from-deg = 1.0", "rear-lidar[0].blocked-to-deg", "two ends"),
        (
            "[[rear-lidar]]\nblocked-from-deg = 1.0\nblocked-to-deg = -1.0",
            "rear-lidar[0].blocked-to-deg",
            "farther left",
        ),
        ("[[rear-lidar]]\ndropout = 1.5", "rear-lidar[0].dropout", "from 0 to 1"),
        ("[[rear-lidar]]\nheight-m = -0.1\n".repeat(3).as_str(), "rear-lidar[0].height-m", "from -0.2 to 0.5"),
        (
            "[[rear-lidar]]\npitch-deg = 3\nfrom-s = 1.0\n[[rear-lidar]]\npitch-deg = -2\nuntil-s = 9.0\n\
             [[rear-lidar]]\npitch-deg = 3\nfrom-s = 2.0",
            "rear-lidar[1].pitch-deg",
            "from -5 to 5",
        ),
        ("[[rear-lidar]]\nyaw-deg = 3\n".repeat(2).as_str(), "rear-lidar[0].yaw-deg", "from -5 to 5"),
        ("[[rear-camera]]\ndirt = -0.1", "rear-camera[0].dirt", "from 0 to 1"),
        ("[[rear-object]]\nghost-closing-mps = 3.0", "rear-object[0].ghost-gap-m", "the gap"),
        ("[[surround]]\ndelay-s = 0.5", "surround[0].delay-s", "from 0 to 0.4"),
        ("[[front-radar]]\nlost-frames = 1.1", "front-radar[0].lost-frames", "from 0 to 1"),
        ("[[front-radar]]\nrange-share = 0.0", "front-radar[0].range-share", "above 0 and up to 1"),
        ("[[surround]]\nblocked-from-deg = -1.0", "surround[0].blocked-to-deg", "two ends"),
        ("[[rear-radar]]\nside = \"left\"", "rear-radar[0].dead", "an effect of the fault"),
        ("[[rear-radar]]\ndropout = 1.5", "rear-radar[0].dropout", "from 0 to 1"),
        ("[[rear-radar]]\ndelay-s = 0.5", "rear-radar[0].delay-s", "from 0 to 0.4"),
        ("[[rear-radar]]\nyaw-deg = 6", "rear-radar[0].yaw-deg", "from -5 to 5"),
        ("[[rear-radar]]\nyaw-deg = 3\n".repeat(2).as_str(), "rear-radar[0].yaw-deg", "from -5 to 5"),
        ("[[rear-radar]]\nghost-closing-mps = 3.0", "rear-radar[0].ghost-gap-m", "the gap"),
        ("[[rear-radar]]\nghost-gap-m = 201", "rear-radar[0].ghost-gap-m", "from 0 to 200"),
        ("[[rear-radar]]\nrange-share = 0.0", "rear-radar[0].range-share", "above 0 and up to 1"),
        ("[[surround]]\njitter-s = -0.1", "surround[0].jitter-s", "from 0 to 0.4"),
        ("[[rear-object]]\nrange-noise-m = 6", "rear-object[0].range-noise-m", "from 0 to 5"),
        ("[[rear-object]]\nyaw-deg = 3\n".repeat(2).as_str(), "rear-object[0].yaw-deg", "from -5 to 5"),
        (
            "[[rear-object]]\nclock-offset-s = 0.15\n".repeat(2).as_str(),
            "rear-object[0].clock-offset-s",
            "from -0.2 to 0.2",
        ),
        ("[odometry]\nheading-deg = 4", "odometry.heading-deg", "from -3 to 3"),
        ("[odometry]\ncurvature-per-m = 0.01", "odometry.curvature-per-m", "from -0.001 to 0.001"),
        ("[odometry]\nlane-width-m = -2", "odometry.lane-width-m", "from -1 to 1"),
        ("[odometry]\nlateral-m = 0.1\nfrom-s = 3\nuntil-s = 2", "odometry.until-s", "ends after it has begun"),
        ("[odometry]\nspeed-scale = 0.5", "odometry.speed-scale", "from -0.1 to 0.1"),
    ] {
        let message = refused(text);
        assert!(message.contains(key) && message.contains(why), "{text}: {message}");
    }
    let five = "[[rear-lidar]]\ndead = true\n".repeat(5);
    assert!(refused(&five).contains("has 5 entries, but at most 4 are allowed"), "{}", refused(&five));
    assert!(refused("[[rear-lidar]]\ndeaf = true").contains("deaf"));
}

#[test]
fn errors_of_the_mounting_of_different_radars_do_not_add_up() {
    let entry = |side: &str| format!("[[rear-radar]]\nyaw-deg = 3.0\n{side}\n");
    let (left, right, both) = (entry("side = \"left\""), entry("side = \"right\""), entry(""));
    faults(&format!("{left}{right}")).unwrap();
    for text in [format!("{right}{right}"), format!("{both}{left}")] {
        let message = faults(&text).unwrap_err();
        assert!(message.contains("rear-radar[0].yaw-deg") && message.contains("is 6"), "{message}");
    }
}

#[test]
fn errors_of_the_mounting_of_different_sensors_do_not_add_up() {
    let entry = |sensor: &str| format!("[[rear-lidar]]\nyaw-deg = 3.0\n{sensor}\n");
    let (left, right, all) = (entry("sensor = \"left\""), entry("sensor = \"right\""), entry(""));
    faults(&format!("{left}{right}")).unwrap();
    for (text, index) in [(format!("{left}{left}"), 0), (format!("{right}{left}{all}"), 0), (format!("{all}{left}"), 0)]
    {
        let message = faults(&text).unwrap_err();
        assert!(message.contains(&format!("rear-lidar[{index}].yaw-deg")) && message.contains("is 6"), "{message}");
    }
}

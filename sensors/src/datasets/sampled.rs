//! Pictures at the columns and rows that a network reads, to train it: rendering them takes a tenth
//! of the time of whole images.
//!
//! A tenth of the scenes are empty roads, and a tenth are crowded.

use std::path::Path;

use crate::camera::{ExposureKey, Frame, Sampling, mix};

use super::files::Output;
use super::options::USUAL_VEHICLES;
use super::render::scene_rng;
use super::scenes::RandomScene;
use super::summary::DatasetError;
use super::{DatasetSummary, Set};

/// One of so many scenes is empty, and the next one is crowded.
const PERIOD: u32 = 10;
/// Numbers of vehicles in a crowded scene.
const CROWD: std::ops::RangeInclusive<usize> = 6..=10;

/// Renders random scenes at these columns and rows into `folder`: `pixels.rgb` [scenes, rows,
/// columns, 3] and `instances.u8` [scenes, rows, columns] (0: no vehicle, or 1 + the index of the
/// vehicle in its scene), both as bytes, and `vehicles.csv` with a line for each vehicle.
///
/// The same arguments give the same bytes.
///
/// # Errors
/// [`DatasetError`] if a scene cannot be set up, or if a file cannot be written.
pub fn render_sampled(
    set: Set,
    [scenes, seed]: [u64; 2],
    sampling: &Sampling,
    folder: &Path,
) -> Result<DatasetSummary, DatasetError> {
    let output = Output::new(folder)?;
    let scenes = u32::try_from(scenes).unwrap_or(u32::MAX);
    let mut summary = DatasetSummary { scenes, pictures: 0, labels: [0; 4] };
    let (mut pixels, mut instances) = (Vec::new(), Vec::new());
    let mut csv = "scene,instance,class,distance_m\n".to_owned();
    for index in 0..scenes {
        let vehicles = match index % PERIOD {
            0 => 0..=0,
            1 => CROWD,
            _ => USUAL_VEHICLES[0]..=USUAL_VEHICLES[1],
        };
        let scene = RandomScene::draw(set, vehicles, &mut scene_rng(set, seed, index)?)?;
        let key = ExposureKey(mix(seed ^ u64::from(index)));
        let mut frame = Frame::new(&scene.camera, &scene.scene(), key, &[scene.camera.resolution.image()]);
        let picture = frame.sampled(sampling.columns(), sampling.rows());
        pixels.extend_from_slice(&picture.image.rgb);
        instances.extend(picture.instances.iter().map(|instance| u8::try_from(*instance).unwrap_or(u8::MAX)));
        summary.pictures += 1;
        for (other, vehicle) in scene.others.iter().enumerate() {
            let class = vehicle.vehicle.class as usize;
            summary.labels[class] += 1;
            let distance_m = scene.ego.state.s_m - vehicle.state.s_m;
            csv.push_str(&format!("{index},{},{class},{distance_m:.2}\n", other + 1));
        }
    }
    output.write("pixels.rgb", &pixels)?;
    output.write("instances.u8", &instances)?;
    output.write("vehicles.csv", csv.as_bytes())?;
    Ok(summary)
}

//! Renders a data set of labelled aerial pictures:
//! `render_aerial training|held-out PICTURES SEED DIR`.

use std::path::Path;

use closecall_recorded::aerial::dataset::{AerialDatasetOptions, render_aerial_dataset};
use closecall_sensors::datasets::Set;

pub(crate) fn main(arguments: Vec<String>) -> Result<(), Box<dyn std::error::Error>> {
    let [set, pictures, seed, folder] = arguments.as_slice() else {
        return Err("usage: render-aerial training|held-out PICTURES SEED DIR".into());
    };
    let set = match set.as_str() {
        "training" => Set::Training,
        "held-out" => Set::HeldOut,
        other => return Err(format!("`{other}` is not a set: `training` or `held-out` is needed").into()),
    };
    let options = AerialDatasetOptions { set, pictures: pictures.parse()?, seed: seed.parse()? };
    let summary = render_aerial_dataset(&options, Path::new(folder))?;
    #[expect(clippy::print_stdout, reason = "the output of a task")]
    {
        println!("{summary:?}");
    }
    Ok(())
}

//! The scans of a run as point clouds: a folder with one PCD file for each scan.
//!
//! The files are `SENSOR-FRAME.pcd`, such as `rear-lidar-00012.pcd`, in the format PCD 0.7 of the
//! Point Cloud Library (*The PCD (Point Cloud Data) file format*), with binary data in
//! little-endian order:
//!
//! | field | type | meaning |
//! |---|---|---|
//! | `x`, `y`, `z` | F 4 | the point in the ego's vehicle frame at the end of the scan (m) |
//! | `intensity` | F 4 | as in the table |
//! | `beam` | U 2 | as in the table |
//! | `time` | F 8 | time of measurement (s) |
//! | `echo_pulse_width_ns` | F 4 | as in the table |
//!
//! `scans.csv` lists the files with the end of each scan, and `poses.csv` and `labels.csv` have the
//! poses of the ego and the other vehicles (`crate::tables::companions`). The points are already in
//! the ego's frame, so the viewpoint of each file is the identity. The format has no place for some
//! columns (direction, range, box, truth): only the table has them.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use closecall_sensors::MountedLidar;
use closecall_sensors::lidar::RearLidar;
use closecall_traffic::atomic::parent_folder;
use tempfile::{Builder, TempDir};

use crate::tables::scan_columns::sign;

/// Number of nanoseconds in a second.
const NS_PER_S: f64 = 1e9;

/// The folder of the point clouds, which has another name until it is complete.
pub(crate) struct PcdFolder {
    folder: TempDir,
}

impl PcdFolder {
    /// Creates the folder that is to become `path`.
    ///
    /// # Errors
    /// An error if `path` exists and is not an empty folder, or if no folder can be created there.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        check_free(path)?;
        let mut builder = Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            const ALL_ACCESS: u32 = 0o777;
            builder.permissions(fs::Permissions::from_mode(ALL_ACCESS));
        }
        Ok(Self { folder: builder.prefix(".scans").tempdir_in(parent_folder(path))? })
    }

    /// Returns the path of the folder until it is complete.
    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes the latest scan of a LiDAR, which must be complete, as its scan number `frame`.
    pub(crate) fn write(&self, mounted: &MountedLidar<'_>, frame: u32, lidar: &RearLidar) -> io::Result<()> {
        let path = self.folder.path().join(file_name(mounted, frame));
        let mut file = io::BufWriter::new(fs::File::create(path)?);
        let scan = lidar.latest();
        let points = scan.len();
        write!(
            file,
            "# .PCD v0.7 - Point Cloud Data file format\n\
             VERSION 0.7\n\
             FIELDS x y z intensity beam time echo_pulse_width_ns\n\
             SIZE 4 4 4 4 2 8 4\n\
             TYPE F F F F U F F\n\
             COUNT 1 1 1 1 1 1 1\n\
             WIDTH {points}\n\
             HEIGHT 1\n\
             VIEWPOINT 0 0 0 1 0 0 0\n\
             POINTS {points}\n\
             DATA binary\n"
        )?;
        for point in 0..points {
            let [x_m, y_m] = [scan.x_m[point], scan.y_m[point]].map(|at_m| sign(mounted) * at_m);
            for value in [x_m, y_m, scan.z_m[point], scan.echoes.intensity[point]] {
                file.write_all(&value.to_le_bytes())?;
            }
            file.write_all(&scan.beam[point].to_le_bytes())?;
            let time_s = scan.start.s() + f64::from(scan.offset_ns[point]) / NS_PER_S;
            file.write_all(&time_s.to_le_bytes())?;
            file.write_all(&scan.echoes.pulse_width_ns[point].to_le_bytes())?;
        }
        file.flush()
    }

    /// Gives the folder its name.
    pub(crate) fn finish(self, path: &Path) -> io::Result<()> {
        check_free(path)?;
        let complete: PathBuf = self.folder.keep();
        fs::rename(&complete, path).inspect_err(|_| {
            // The folder has no other use. The first error says all that an error of the removal
            // could say.
            let _ = fs::remove_dir_all(&complete);
        })
    }
}

/// Returns the name of the file of a scan.
pub(crate) fn file_name(mounted: &MountedLidar<'_>, frame: u32) -> String {
    format!("{}-{frame:05}.pcd", mounted.name)
}

/// Checks that `path` has nothing that the folder would replace.
fn check_free(path: &Path) -> io::Result<()> {
    let message = "exists, and is not an empty folder: scans *.pcd are a new folder with a file for each scan";
    match fs::read_dir(path).map(|mut entries| entries.next().is_none()) {
        Ok(true) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Ok(false) | Err(_) => Err(io::Error::new(io::ErrorKind::AlreadyExists, message)),
    }
}

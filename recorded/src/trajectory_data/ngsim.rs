//! The layout of NGSIM: feet, feet per second, milliseconds. The reference point of a vehicle is
//! the middle of its front bumper.

use closecall_traffic::{Time, VehicleClass};

use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, FieldError, integer, number, wrong_value};
use super::file_layout::Layout;
use super::header::Header;
use super::plain::allowed;
use super::rows::Fields;
use super::source::{Clock, FileInfo, Row};
use super::text_layout::TextLayout;

/// The international foot (m).
const FOOT_M: f64 = 0.3048;

/// NGSIM's period, at 10 Hz.
pub(super) const PERIOD: Time = Time::from_ms(100);

/// NGSIM's codes for vehicle classes.
const CLASSES: [(i64, VehicleClass); 3] =
    [(1, VehicleClass::Motorcycle), (2, VehicleClass::Car), (3, VehicleClass::Truck)];

/// Columns with the numbers of intersections and of street sections.
const STREET: [&str; 2] = ["Int_ID", "Section_ID"];
/// The locations of the urban streets.
const URBAN: [&str; 2] = ["lankershim", "peachtree"];

/// Allowed values of the columns, in the units of the file: feet and milliseconds.
mod limits {
    use super::{Bounds, FOOT_M, allowed};

    /// Converts a range from metres to feet, rounded to whole feet.
    pub(super) const fn in_feet(metres: Bounds) -> Bounds {
        let Bounds { low, high, low_is_allowed } = metres;
        Bounds { low: (low / FOOT_M).round(), high: (high / FOOT_M).round(), low_is_allowed }
    }

    pub(super) const POSITION: Bounds = in_feet(allowed::POSITION_M);
    pub(super) const LATERAL: Bounds = in_feet(allowed::LATERAL_M);
    pub(super) const SPEED: Bounds = in_feet(allowed::SPEED_MPS);
    pub(super) const ACCELERATION: Bounds = in_feet(allowed::ACCELERATION_MPS2);
    pub(super) const LENGTH: Bounds = in_feet(allowed::LENGTH_M);
    pub(super) const WIDTH: Bounds = in_feet(allowed::WIDTH_M);
    /// Milliseconds since 1970, up to the year 2100.
    pub(super) const TIME_MS: (i64, i64) = (0, 4_102_444_800_000);
}

/// The column indices of NGSIM's quantities.
pub(super) struct NgsimColumns {
    vehicle: usize,
    frame: usize,
    time: usize,
    x: usize,
    y: usize,
    length: usize,
    width: usize,
    class: usize,
    speed: usize,
    acceleration: usize,
    lane: usize,
    location: Option<usize>,
    /// The columns [`STREET`], whose numbers are 0 on motorways.
    street: [Option<usize>; 2],
    /// `true` if a row was recorded on an urban street.
    is_urban: bool,
}

impl NgsimColumns {
    /// The column names by which the layout is detected.
    pub(super) const NAMES: [&str; 11] = [
        "Vehicle_ID",
        "Frame_ID",
        "Global_Time",
        "Local_X",
        "Local_Y",
        "v_Length",
        "v_Width",
        "v_Class",
        "v_Vel",
        "v_Acc",
        "Lane_ID",
    ];

    /// The column order of the original files, which have no header.
    pub(super) const ORIGINAL: Self = Self {
        vehicle: 0,
        frame: 1,
        time: 3,
        x: 4,
        y: 5,
        length: 8,
        width: 9,
        class: 10,
        speed: 11,
        acceleration: 12,
        lane: 13,
        location: None,
        street: [None; 2],
        is_urban: false,
    };

    /// Finds the columns in `header`.
    ///
    /// # Errors
    /// Fails if a required column is missing.
    pub(super) fn new(header: &Header) -> Result<Self, TrajectoryFileProblem> {
        let [vehicle, frame, time, x, y, length, width, class, speed, acceleration, lane] = Self::NAMES;
        let need = |name| header.require(name, "NGSIM");
        Ok(Self {
            vehicle: need(vehicle)?,
            frame: need(frame)?,
            time: need(time)?,
            x: need(x)?,
            y: need(y)?,
            length: need(length)?,
            width: need(width)?,
            class: need(class)?,
            speed: need(speed)?,
            acceleration: need(acceleration)?,
            lane: need(lane)?,
            location: header.find("Location"),
            street: STREET.map(|name| header.find(name)),
            is_urban: false,
        })
    }

    /// Returns `true` if the columns are the columns of the catalogue's export.
    fn is_export(&self) -> bool {
        self.location.is_some()
    }
}

impl TextLayout for NgsimColumns {
    fn info(&self) -> FileInfo {
        let layout = if self.is_export() { Layout::Ngsim25 } else { Layout::Ngsim18 };
        FileInfo { layout, name: None, period: None, markings: None }
    }

    fn data<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)> {
        self.location.map(|index| ("Location", fields.get(line, index)))
    }

    fn warnings(&self) -> Vec<String> {
        let urban = self.is_urban.then(|| {
            "it records an urban street, with intersections: the quantities of motorway traffic may mean nothing here".to_owned()
        });
        urban.into_iter().collect()
    }

    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, FieldError> {
        if !self.is_urban {
            let text = |column: Option<usize>| column.map_or("", |index| fields.get(line, index));
            let is_street = |column| text(column).parse::<f64>().is_ok_and(|number| number != 0.0);
            let location = text(self.location);
            self.is_urban =
                self.street.into_iter().any(is_street) || URBAN.iter().any(|name| name.eq_ignore_ascii_case(location));
        }
        let whole = |index, name, range| integer(fields.get(line, index), name, range);
        let metres = |index, name, bounds| -> Result<f64, FieldError> {
            Ok(number(fields.get(line, index), name, bounds)? * FOOT_M)
        };
        let vehicle = whole(self.vehicle, "Vehicle_ID", allowed::IDS)?.unsigned_abs();
        let length_m = metres(self.length, "v_Length", limits::LENGTH)?;
        let front_m = metres(self.y, "Local_Y", limits::POSITION)?;
        let right_m = metres(self.x, "Local_X", limits::LATERAL)?;
        let frame = whole(self.frame, "Frame_ID", allowed::FRAMES)?;
        let time = Time::from_ms(whole(self.time, "Global_Time", limits::TIME_MS)?);
        let (origin, clock) = match self.location {
            Some(_) => (time - PERIOD * frame, Clock::Continuous),
            None => (Time::ZERO, Clock::MayRestart),
        };
        let row = Row {
            number: vehicle,
            origin,
            vehicle_id: vehicle,
            frame,
            time,
            clock,
            s_m: front_m - 0.5 * length_m,
            d_m: -right_m,
            lane: whole(self.lane, "Lane_ID", allowed::LANES)?.unsigned_abs() as u8,
            speed_mps: metres(self.speed, "v_Vel", limits::SPEED)?,
            acceleration_mps2: Some(metres(self.acceleration, "v_Acc", limits::ACCELERATION)?),
            length_m,
            width_m: metres(self.width, "v_Width", limits::WIDTH)?,
            class: class(fields.get(line, self.class))?,
            marking_distances: MarkingDistances::default(),
            line: 0,
        };
        Ok(Some(row))
    }
}

fn class(text: &str) -> Result<VehicleClass, FieldError> {
    let code = integer(text, "v_Class", (1, 3));
    let named = code.ok().and_then(|code| CLASSES.into_iter().find(|(listed, _)| *listed == code));
    named.map(|(_, class)| class).ok_or_else(|| {
        FieldError::at("v_Class", wrong_value(text, "one of 1 (motorcycle), 2 (car), 3 (truck)".to_owned()))
    })
}

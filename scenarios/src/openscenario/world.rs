//! The vehicles of a scenario at one instant of its storyboard, on parallel lanes.

/// A vehicle.
#[derive(Clone, Debug, Default)]
pub(super) struct Vehicle {
    pub(super) name: String,
    /// Line of its element in the file.
    pub(super) line: usize,
    /// Line and name of the element that says where it starts.
    pub(super) start: (usize, String),
    /// Class of Closecall: `car`, `truck` or `motorcycle`.
    pub(super) class: &'static str,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) height_m: f64,
    pub(super) mass_kg: Option<f64>,
    /// From the reference point, the rear axle, forwards to the centre of the box (m).
    pub(super) centre_m: f64,
    /// Position of the reference point along the road (m).
    pub(super) s_m: f64,
    /// Lane of OpenDRIVE; the target lane while the vehicle changes lanes.
    pub(super) lane: i32,
    /// From the centre of the lane, positive to the left (m).
    pub(super) offset_m: f64,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: f64,
    pub(super) travelled_m: f64,
    /// Whether the file says where it starts.
    pub(super) is_placed: bool,
}

impl Vehicle {
    pub(super) fn front_m(&self) -> f64 {
        self.s_m + self.centre_m + 0.5 * self.length_m
    }

    pub(super) fn back_m(&self) -> f64 {
        self.s_m + self.centre_m - 0.5 * self.length_m
    }

    /// Returns the distance to another vehicle along the road, positive ahead (m): between the
    /// reference points or, in free space, between the bumpers. Vehicles beside each other have
    /// none.
    pub(super) fn distance_m(&self, other: &Self, is_free_space: bool) -> f64 {
        let between_m = other.s_m - self.s_m;
        match is_free_space {
            false => between_m,
            true if other.back_m() > self.front_m() => other.back_m() - self.front_m(),
            true if other.front_m() < self.back_m() => other.front_m() - self.back_m(),
            true => 0.0,
        }
    }

    /// Returns the distance to a place along the road, positive ahead (m): from the reference point
    /// or, in free space, from the nearer bumper. A place beside the vehicle has none.
    pub(super) fn distance_to_m(&self, place_m: f64, is_free_space: bool) -> f64 {
        match is_free_space {
            false => place_m - self.s_m,
            true => place_m - place_m.clamp(self.back_m(), self.front_m()),
        }
    }
}

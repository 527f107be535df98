//! Criteria that have an option of their own on the command line.

use closecall_scenarios::criteria::Expression;

/// The options, each `None` if it is not given. All bounds are inclusive.
#[derive(Clone, Copy, Debug, Default)]
pub struct GateOptions {
    /// Largest number of samples in which the ego collides, in any scenario.
    pub max_collisions: Option<u64>,
    /// Largest number of samples in which vehicles other than the ego collide, in any scenario.
    pub max_other_collisions: Option<u64>,
    /// Largest number of induced collisions, in any scenario.
    pub max_induced: Option<u64>,
    /// Smallest share of the baseline's collisions that the system prevents, with 95 % confidence.
    pub min_prevented: Option<f64>,
    /// Largest harm (expected driver deaths).
    pub max_harm: Option<f64>,
    /// Smallest time headway of the rear vehicle (s).
    pub min_rear_thw: Option<f64>,
    /// Largest share of the samples in which the margin increase system engages.
    pub max_engagement_rate: Option<f64>,
    /// Largest speed deficit of the ego to the lead vehicle (m/s).
    pub max_speed_deficit_mps: Option<f64>,
    /// Largest jerk of the ego (m/s³).
    pub max_jerk: Option<f64>,
}

impl GateOptions {
    /// Returns the criteria that the options stand for.
    ///
    /// # Errors
    /// The message of a criterion that cannot be read: a bound that is not finite.
    pub fn criteria(&self) -> Result<Vec<Expression>, String> {
        let options = [
            self.max_collisions.map(|most| format!("count(ego_collided) <= {most}")),
            self.max_other_collisions.map(|most| format!("count(others_collided) <= {most}")),
            self.max_induced.map(|most| format!("count(induced) <= {most}")),
            self.min_prevented.map(|least| format!("lower(prevented | baseline.ego_collided) >= {least}")),
            self.max_harm.map(|most| format!("sum(harm) <= {most}")),
            self.min_rear_thw.map(|least| format!("min(min_thw_rear_s) >= {least}")),
            self.max_engagement_rate.map(|most| format!("share(engaged) <= {most}")),
            self.max_speed_deficit_mps.map(|most| format!("max(max_speed_deficit_mps) <= {most}")),
            self.max_jerk.map(|most| format!("max(max_jerk_mps3) <= {most}")),
        ];
        options.into_iter().flatten().map(|text| text.parse().map_err(|error| format!("{error}"))).collect()
    }
}

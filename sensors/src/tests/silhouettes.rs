//! The bodies that the LiDAR and the camera build have the same silhouette.

use closecall_traffic::{BodyShape, Dimensions, Vehicle, VehicleClass};

use crate::camera::body_triangles;
use crate::lidar::append_solids;

/// Largest difference of the height, and of each end of the vehicle (m).
const END_TOLERANCE_M: f64 = 0.05;
/// Largest difference of the ends of the roof and of the windows (m), where surfaces are inclined.
const ROOF_TOLERANCE_M: f64 = 0.1;
/// Heights at which the ends are compared (shares of the height): in the middle of the windows, and
/// below the roof.
const LEVELS: [f64; 2] = [0.70, 0.93];
/// Lateral position of the compared side view (m): next to the centre line, on which edges of the
/// mesh lie.
const SLICE_Y_M: f64 = 0.02;
/// Distance between two compared positions along the vehicle (m).
const STEP_M: f64 = 0.01;

/// The side view of a body near its centre line.
struct SideView {
    /// Ends of the whole body (m), not only of the slice.
    ends_m: [f64; 2],
    /// Position along the vehicle (m), and greatest height there (m).
    outline: Vec<[f64; 2]>,
}

impl SideView {
    fn new(ends_m: [f64; 2], height_m: impl Fn(f64) -> Option<f64>) -> Self {
        let steps = ((ends_m[1] - ends_m[0]) / STEP_M) as i32;
        let at = |step| ends_m[0] + STEP_M * f64::from(step);
        let outline = (0..=steps).filter_map(|step| Some([at(step), height_m(at(step))?])).collect();
        Self { ends_m, outline }
    }

    fn lidar(vehicle: &Vehicle) -> Self {
        let mut solids = Vec::new();
        append_solids(vehicle, &mut solids);
        let ends_m = [
            solids.iter().map(|solid| solid.low.x).fold(f64::MAX, f64::min),
            solids.iter().map(|solid| solid.high.x).fold(f64::MIN, f64::max),
        ];
        Self::new(ends_m, |x| {
            let tops = solids.iter().filter_map(|solid| {
                // The vertical line through (x, y) is cut to the part within all half-spaces.
                let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
                for face in solid.faces() {
                    let room = face.offset_m - face.normal.x * x - face.normal.y * SLICE_Y_M;
                    if face.normal.z > 1e-9 {
                        high = high.min(room / face.normal.z);
                    } else if face.normal.z < -1e-9 {
                        low = low.max(room / face.normal.z);
                    } else if room < 0.0 {
                        return None;
                    }
                }
                (low <= high).then_some(high)
            });
            tops.reduce(f64::max)
        })
    }

    fn camera(vehicle: &Vehicle) -> Self {
        let triangles = body_triangles(vehicle);
        let along = || triangles.iter().flat_map(|triangle| triangle.corners_m).map(|corner| f64::from(corner[0]));
        let ends_m = [along().fold(f64::MAX, f64::min), along().fold(f64::MIN, f64::max)];
        Self::new(ends_m, |x| {
            let tops = triangles.iter().filter_map(|triangle| {
                let [a, b, c] = triangle.corners_m.map(|corner| corner.map(f64::from));
                let cross =
                    |p: [f64; 3], q: [f64; 3]| (p[0] - x) * (q[1] - SLICE_Y_M) - (q[0] - x) * (p[1] - SLICE_Y_M);
                let weights = [cross(b, c), cross(c, a), cross(a, b)];
                let sum: f64 = weights.iter().sum();
                let inside = sum.abs() > 1e-9 && weights.iter().all(|weight| weight * sum >= 0.0);
                inside.then(|| (weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]) / sum)
            });
            tops.reduce(f64::max)
        })
    }

    fn height_m(&self) -> f64 {
        self.outline.iter().map(|at| at[1]).fold(0.0, f64::max)
    }

    /// Returns the ends of the part of the body that reaches above this height (m).
    fn ends_above_m(&self, height_m: f64) -> [f64; 2] {
        let mut above = self.outline.iter().filter(|at| at[1] >= height_m).map(|at| at[0]);
        let first = above.next().unwrap();
        [first, above.next_back().unwrap_or(first)]
    }
}

fn assert_same_silhouette(shape: BodyShape, dimensions: Dimensions) {
    let mut vehicle = Vehicle::typical(shape.class());
    vehicle.appearance.body_shape = shape;
    vehicle.dimensions = dimensions;
    let [lidar, camera] = [SideView::lidar(&vehicle), SideView::camera(&vehicle)];
    let close = |[a, b]: [f64; 2], [c, d]: [f64; 2], tolerance: f64| (a - c).abs().max((b - d).abs()) < tolerance;
    assert!(close(lidar.ends_m, camera.ends_m, END_TOLERANCE_M), "{shape}: {:?} {:?}", lidar.ends_m, camera.ends_m);
    let heights_m = [lidar.height_m(), camera.height_m()];
    assert!((heights_m[0] - heights_m[1]).abs() < END_TOLERANCE_M, "{shape}: heights {heights_m:?}");
    for level in LEVELS {
        let [seen, drawn] = [&lidar, &camera].map(|view| view.ends_above_m(level * dimensions.height_m));
        assert!(close(seen, drawn, ROOF_TOLERANCE_M), "{shape} above {level} of its height: {seen:?} and {drawn:?}");
    }
}

#[test]
fn lidar_and_camera_see_the_same_silhouette_of_every_shape() {
    for class in VehicleClass::ALL {
        for &shape in BodyShape::of_class(class) {
            assert_same_silhouette(shape, shape.usual_dimensions());
            assert_same_silhouette(shape, class.typical_dimensions());
        }
    }
}

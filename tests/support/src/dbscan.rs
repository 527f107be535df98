//! DBSCAN as Ester et al. (1996) define it, as a reference for faster implementations.

/// Returns the cluster of each point, `None` for noise.
///
/// A core point has at least `core_points` points at most `radius` away, itself included. A cluster
/// is a connected component of core points, with the other points within the radius of one of them.
/// Clusters are numbered in the order of their first core points. A point at the border of several
/// clusters belongs to the first of these. Takes time with the square of the number of points.
pub fn dbscan_by_definition(points: &[[f64; 2]], radius: f64, core_points: usize) -> Vec<Option<usize>> {
    let is_near = |one: [f64; 2], other: [f64; 2]| {
        let (x, y) = (one[0] - other[0], one[1] - other[1]);
        x * x + y * y <= radius * radius
    };
    let near = |at: [f64; 2]| (0..points.len()).filter(move |&to| is_near(at, points[to]));
    let is_core: Vec<bool> = points.iter().map(|&at| near(at).count() >= core_points).collect();
    let mut labels = vec![None; points.len()];
    let mut clusters = 0;
    for first in 0..points.len() {
        if labels[first].is_some() || !is_core[first] {
            continue;
        }
        labels[first] = Some(clusters);
        let mut open = vec![first];
        while let Some(core) = open.pop() {
            for row in near(points[core]) {
                if labels[row].is_none() && is_core[row] {
                    labels[row] = Some(clusters);
                    open.push(row);
                }
            }
        }
        clusters += 1;
    }
    // The labels of the core points are final here.
    let of_cores = labels.clone();
    for row in (0..points.len()).filter(|&row| !is_core[row]) {
        labels[row] = near(points[row]).filter(|&to| is_core[to]).filter_map(|to| of_cores[to]).min();
    }
    labels
}

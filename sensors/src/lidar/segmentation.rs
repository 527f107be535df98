//! Segmentation quality: compares clusters with the ground truth, and counts vehicles that are
//! split into several clusters or merged into one.

use super::{PointSource, ScanTruth};

/// A vehicle with fewer points than this in a cluster, or in a scan, is not counted there.
const MIN_POINTS: usize = 3;

/// Segmentation errors, counted over several scans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SegmentationReport {
    /// Vehicles with enough points to be detected, summed over the scans.
    pub(crate) vehicles: usize,
    /// Number of these vehicles whose points lie in more than one cluster.
    pub(crate) over_segmented: usize,
    /// Number of these vehicles whose points lie in no cluster.
    pub(crate) missed: usize,
    /// Clusters that contain more than one vehicle.
    pub(crate) under_segmented: usize,
    /// Clusters most of whose points do not originate from a vehicle.
    pub(crate) background: usize,
}

impl SegmentationReport {
    /// Adds one scan. `clusters` yields the indices of each cluster's points in the scan.
    pub(crate) fn observe<'a>(&mut self, truth: &ScanTruth, clusters: impl Iterator<Item = &'a [u32]>) {
        let mut in_scan: Vec<(usize, usize)> = Vec::new();
        count(truth.points.iter().map(|point| point.source), &mut in_scan);
        in_scan.retain(|&(_, points)| points >= MIN_POINTS);
        let mut clusters_with = vec![0_usize; in_scan.len()];
        let mut in_cluster: Vec<(usize, usize)> = Vec::new();
        for members in clusters {
            in_cluster.clear();
            count(members.iter().map(|&member| truth.points[member as usize].source), &mut in_cluster);
            let from_vehicles: usize = in_cluster.iter().map(|&(_, points)| points).sum();
            in_cluster.retain(|&(_, points)| points >= MIN_POINTS);
            self.background += usize::from(2 * from_vehicles < members.len());
            self.under_segmented += usize::from(in_cluster.len() > 1);
            for &(actor, _) in &in_cluster {
                if let Some(index) = in_scan.iter().position(|&(other, _)| other == actor) {
                    clusters_with[index] += 1;
                }
            }
        }
        self.vehicles += in_scan.len();
        self.over_segmented += clusters_with.iter().filter(|&&n| n > 1).count();
        self.missed += clusters_with.iter().filter(|&&n| n == 0).count();
    }
}

/// Counts the points of each actor. The actors are in order of first appearance.
fn count(sources: impl Iterator<Item = PointSource>, counts: &mut Vec<(usize, usize)>) {
    for source in sources {
        if let PointSource::Actor(actor) = source {
            match counts.iter_mut().find(|(other, _)| *other == actor) {
                Some((_, points)) => *points += 1,
                None => counts.push((actor, 1)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Material, PointTruth};
    use super::*;

    #[test]
    fn counts_split_merged_and_missed_vehicles() {
        let point_truth = |actor: Option<usize>| PointTruth {
            source: actor.map_or(PointSource::Ground, PointSource::Actor),
            material: Material::Paint,
            range_m: 10.0,
        };
        let actors = [0, 0, 0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3].map(Some).into_iter().chain([None; 3]);
        let truth = ScanTruth { points: actors.map(point_truth).collect() };
        // Actor 0 is split, actors 1 and 2 are merged, and actor 3 is missed. The last cluster is
        // ground.
        let clusters: [&[u32]; 4] = [&[0, 1, 2], &[3, 4, 5], &[6, 7, 8, 9, 10, 11], &[15, 16, 17]];
        let mut report = SegmentationReport::default();
        report.observe(&truth, clusters.into_iter());
        let expected =
            SegmentationReport { vehicles: 4, over_segmented: 1, missed: 1, under_segmented: 1, background: 1 };
        assert_eq!(report, expected);
    }
}

//! From sub-rays to echoes: what the receiver can tell apart along one beam.
//!
//! Sub-rays that end within the length of one pulse add up to one echo, whose power is the sum of their shares; where a
//! beam is split by an edge, or spread over the road at a grazing angle, there are several, each the weaker.

use super::cast::{BeamHits, NO_FACE, place};
use super::pattern::{SUBRAYS, UPWARD};
use super::power::Link;
use super::targets::Face;

/// Length in range that one pulse of about 5 ns takes up: c·τ/2 [m].
pub(crate) const PULSE_M: f32 = 0.75;
/// Share of each sub-ray in the footprint.
const SHARE: f32 = 1.0 / SUBRAYS as f32;

/// One echo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Echo {
    /// Distance, weighted by power [m].
    pub(crate) range_m: f32,
    /// Received power [thresholds].
    pub(crate) power: f32,
    /// The face that sends most of it.
    pub(crate) face: u32,
}

/// The echoes of one beam in order of range.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Echoes {
    list: [Echo; SUBRAYS],
    count: usize,
}

impl Echoes {
    pub(crate) fn as_slice(&self) -> &[Echo] {
        &self.list[..self.count]
    }

    /// The echoes of what the sub-rays met, whose tangents of elevation are `tan`.
    pub(crate) fn of(hits: &BeamHits, tan: [f32; UPWARD], faces: &[Face], link: &Link) -> Self {
        let mut met = [Echo::default(); SUBRAYS];
        let mut count = 0;
        for lane in 0..SUBRAYS {
            if hits.face[lane] == NO_FACE {
                continue;
            }
            let echo = subray_echo(hits.inverse[lane], tan[place(lane).1], hits.face[lane], (faces, link));
            // Insertion sort: eight at most, and mostly in order already.
            let mut place = count;
            while place > 0 && met[place - 1].range_m > echo.range_m {
                met[place] = met[place - 1];
                place -= 1;
            }
            met[place] = echo;
            count += 1;
        }
        let mut echoes = Self::default();
        let mut rest = &met[..count];
        while let Some(first) = rest.first() {
            let within = rest.iter().take_while(|echo| echo.range_m <= first.range_m + PULSE_M).count();
            echoes.list[echoes.count] = merged(&rest[..within], link);
            echoes.count += 1;
            rest = &rest[within..];
        }
        echoes
    }
}

/// What one sub-ray alone sends back, without the air's attenuation.
fn subray_echo(inverse: f32, tan: f32, face: u32, (faces, link): (&[Face], &Link)) -> Echo {
    let surface = &faces[face as usize];
    let slant = (1.0 + tan * tan).sqrt();
    // Inverse range; cos γ is the plane's distance over the range.
    let per_range = inverse / slant;
    let cosine = (surface.offset_m * per_range).min(1.0);
    let power = SHARE * link.gain_m2 * surface.reflectivity * cosine * per_range * per_range;
    Echo { range_m: 1.0 / per_range, power, face }
}

/// One echo out of neighbours.
fn merged(parts: &[Echo], link: &Link) -> Echo {
    let (mut power, mut moment, mut strongest) = (0.0, 0.0, &parts[0]);
    for part in parts {
        power += part.power;
        moment += part.power * part.range_m;
        if part.power > strongest.power {
            strongest = part;
        }
    }
    let range_m = if power > 0.0 { moment / power } else { strongest.range_m };
    Echo { range_m, power: power * link.transmission(range_m), face: strongest.face }
}

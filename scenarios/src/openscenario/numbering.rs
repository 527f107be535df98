//! The numbers of lanes that go on with another number in the next lane section.
//!
//! OpenDRIVE counts the lanes of each section from the reference line. If a lane begins at the side
//! of the reference line, the lanes beside it get another number, and links say which lane goes on as
//! which:
//!
//! ```text
//!            section 0      section 1        in the import
//!                           lane −1          lane −1
//!            lane −1   ──▶  lane −2          lane −2
//! ```
//!
//! The import then counts the lanes of all sections together, in their order from the reference line.

use std::collections::BTreeMap;

use super::entry_lane::Section;

/// The number in the import of each driving lane of each lane section.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Numbering {
    of_sections: Vec<BTreeMap<i32, i32>>,
}

impl Numbering {
    /// Returns the numbers of a road whose lanes get other numbers, or `None` if each lane keeps its
    /// number, or if no order of the lanes fits all sections.
    pub(super) fn read(sections: &[Section<'_>]) -> Option<Self> {
        let mut has_changed = false;
        // The lane of each section by its number in the file: an index of all lanes.
        let mut of_sections: Vec<BTreeMap<i32, usize>> = Vec::new();
        let mut count = 0;
        for (index, (_, lanes)) in sections.iter().enumerate() {
            let mut of_section = BTreeMap::new();
            for id in lanes.keys() {
                let before =
                    index.checked_sub(1).and_then(|before| before_id(&sections[before], &sections[index], *id));
                has_changed |= before.is_some_and(|before| before != *id);
                let lane = before.and_then(|before| of_sections[index - 1].get(&before).copied());
                // Of two lanes that join, one goes on.
                let lane = lane.filter(|lane| of_section.values().all(|other| other != lane));
                of_section.insert(*id, lane.unwrap_or(count));
                count += usize::from(lane.is_none());
            }
            of_sections.push(of_section);
        }
        let ranks = has_changed.then(|| ranks(&of_sections, count))??;
        let numbered = |of_section: BTreeMap<i32, usize>| -> Option<BTreeMap<i32, i32>> {
            let number = |(id, lane): (i32, usize)| Some((id, id.signum() * i32::try_from(ranks[lane] + 1).ok()?));
            of_section.into_iter().map(number).collect()
        };
        Some(Self { of_sections: of_sections.into_iter().map(numbered).collect::<Option<_>>()? })
    }

    /// Returns the number in the import of a lane of a section.
    pub(super) fn number(&self, section: usize, id: i32) -> Option<i32> {
        self.of_sections.get(section)?.get(&id).copied()
    }
}

/// Returns the lane of the section before that goes on as a lane: the links say so, or the lane with
/// the same number if neither of both has a link.
fn before_id((_, before): &Section<'_>, (_, lanes): &Section<'_>, id: i32) -> Option<i32> {
    let link = |lanes: &BTreeMap<i32, &super::dom::Node>, id: i32, name: &str| -> Option<i32> {
        lanes.get(&id)?.at(&["link", name])?.raw("id")?.trim().parse().ok()
    };
    let successor = |other: i32| link(before, other, "successor");
    let predecessor = link(lanes, id, "predecessor");
    let is_unlinked = before.contains_key(&id) && successor(id).is_none() && predecessor.is_none();
    let goes_on = |other: &i32| successor(*other) == Some(id);
    let by_successor = || [id].into_iter().chain(before.keys().copied()).find(goes_on);
    predecessor.filter(|other| before.contains_key(other)).or_else(by_successor).or(is_unlinked.then_some(id))
}

/// Returns the place of each lane in an order from the reference line that fits all sections.
fn ranks(of_sections: &[BTreeMap<i32, usize>], count: usize) -> Option<Vec<usize>> {
    let in_order = |of_section: &BTreeMap<i32, usize>| {
        let mut lanes: Vec<(u32, usize)> = of_section.iter().map(|(id, lane)| (id.unsigned_abs(), *lane)).collect();
        lanes.sort_unstable();
        lanes.into_iter().map(|(_, lane)| lane).collect::<Vec<usize>>()
    };
    let orders: Vec<Vec<usize>> = of_sections.iter().map(in_order).collect();
    let mut ranks = vec![None; count];
    for rank in 0..count {
        let is_next = |lane: &usize| {
            let lies_behind = |order: &Vec<usize>| {
                let inner = order.iter().take_while(|other| *other != lane);
                order.contains(lane) && inner.into_iter().any(|other| ranks[*other].is_none())
            };
            ranks[*lane].is_none() && !orders.iter().any(lies_behind)
        };
        let next = (0..count).find(is_next)?;
        ranks[next] = Some(rank);
    }
    ranks.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::dom::parse;
    use super::super::entry_lane;
    use super::*;

    /// Reads sections of lanes: the number of each, of its predecessor and of its successor, or 0.
    fn read(sections: &[&[[i32; 3]]]) -> Option<Vec<Vec<[i32; 2]>>> {
        let link = |name: &str, id: i32| if id == 0 { String::new() } else { format!("<{name} id=\"{id}\"/>") };
        let lane = |[id, before, next]: &[i32; 3]| {
            let links = link("predecessor", *before) + &link("successor", *next);
            format!("<lane id=\"{id}\" type=\"driving\"><link>{links}</link></lane>")
        };
        let section = |lanes: &&[[i32; 3]]| {
            let side = if lanes[0][0] < 0 { "right" } else { "left" };
            format!("<laneSection><{side}>{}</{side}></laneSection>", lanes.iter().map(lane).collect::<String>())
        };
        let text = format!("<lanes>{}</lanes>", sections.iter().map(section).collect::<String>());
        let lanes = parse(Path::new("road.xodr"), &text).unwrap();
        let side = if sections[0][0][0] < 0 { "right" } else { "left" };
        let nodes: Vec<_> = lanes.all("laneSection").map(|node| entry_lane::section(node, side).unwrap()).collect();
        let numbering = Numbering::read(&nodes)?;
        let of_section = |(index, lanes): (usize, &&[[i32; 3]])| {
            lanes.iter().map(|[id, ..]| [*id, numbering.number(index, *id).unwrap()]).collect()
        };
        Some(sections.iter().enumerate().map(of_section).collect())
    }

    #[test]
    fn a_lane_that_begins_and_ends_beside_the_reference_line_leaves_the_others_their_number() {
        for side in [-1, 1] {
            let lane = |ids: [i32; 3]| ids.map(|id| id * side);
            let sections =
                [&[lane([1, 0, 2])][..], &[lane([1, 0, 0]), lane([2, 1, 1])], &[lane([1, 2, 0]), lane([2, 0, 0])]];
            let expected = [&[[1, 2]][..], &[[1, 1], [2, 2]], &[[1, 2], [2, 3]]];
            let expected =
                expected.map(|section| section.iter().map(|pair| pair.map(|id| id * side)).collect::<Vec<_>>());
            assert_eq!(read(&sections).unwrap(), expected);
        }
    }

    #[test]
    fn lanes_that_keep_their_numbers_need_no_other_ones() {
        assert_eq!(read(&[&[[-1, 0, -1], [-2, 0, -2]], &[[-1, -1, 0], [-2, -2, 0], [-3, 0, 0]]]), None);
        assert_eq!(read(&[&[[-1, 0, 0]], &[[-1, 0, 0], [-2, 0, 0]]]), None);
    }

    #[test]
    fn of_two_lanes_that_join_one_goes_on() {
        let joined = read(&[&[[-1, 0, -1], [-2, 0, -1], [-3, 0, -2]], &[[-1, 0, 0], [-2, -3, 0]]]).unwrap();
        assert_eq!(joined, [vec![[-1, -1], [-2, -2], [-3, -3]], vec![[-1, -1], [-2, -3]]]);
    }

    #[test]
    fn lanes_that_change_places_have_no_numbers() {
        assert_eq!(read(&[&[[-1, 0, -2], [-2, 0, -1]], &[[-1, -2, 0], [-2, -1, 0]]]), None);
    }
}

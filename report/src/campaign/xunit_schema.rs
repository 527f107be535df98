//! The schema `junit-10.xsd` of Jenkins' plugin xUnit (github.com/jenkinsci/xunit-plugin), for
//! tests.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// An element of the schema.
struct Element {
    name: &'static str,
    /// The elements that it may hold.
    children: &'static [&'static str],
    /// The required attributes, and the optional ones.
    attributes: [&'static [&'static str]; 2],
}

const SCHEMA: [Element; 9] = [
    Element { name: "", children: &["testsuites"], attributes: [&[], &[]] },
    Element {
        name: "testsuites",
        children: &["testsuite"],
        attributes: [&[], &["name", "time", "tests", "failures", "errors"]],
    },
    Element {
        name: "testsuite",
        children: &["testsuite", "properties", "testcase", "system-out", "system-err"],
        attributes: [&["name", "tests", "failures", "errors"], &["time", "skipped", "timestamp", "hostname"]],
    },
    Element { name: "properties", children: &["property"], attributes: [&[], &[]] },
    Element { name: "property", children: &[], attributes: [&["name", "value"], &[]] },
    Element {
        name: "testcase",
        children: &["skipped", "error", "failure", "system-out", "system-err"],
        attributes: [&["name"], &["time", "classname"]],
    },
    Element { name: "failure", children: &[], attributes: [&[], &["type", "message"]] },
    Element { name: "error", children: &[], attributes: [&[], &["type", "message"]] },
    Element { name: "skipped", children: &[], attributes: [&[], &["type", "message"]] },
];

/// Returns the parts of a file that the schema refuses.
pub(super) fn against_schema(xml: &str) -> Vec<String> {
    let mut reader = Reader::from_str(xml);
    let (mut open, mut refused) = (vec![String::new()], Vec::new());
    loop {
        match reader.read_event().unwrap() {
            Event::Start(start) => {
                refused.extend(wrong(&open, &start));
                open.push(String::from_utf8(start.name().as_ref().to_vec()).unwrap());
            }
            Event::Empty(start) => refused.extend(wrong(&open, &start)),
            Event::End(_) => drop(open.pop()),
            Event::Eof => return refused,
            _ => {}
        }
    }
}

/// Returns the fault of an element within the open elements.
fn wrong(open: &[String], start: &BytesStart<'_>) -> Vec<String> {
    let name = String::from_utf8(start.name().as_ref().to_vec()).unwrap();
    let element = |name: &str| SCHEMA.iter().find(|element| element.name == name);
    let parent = open.last().unwrap();
    let is_child = element(parent).is_some_and(|parent| parent.children.contains(&name.as_str()));
    let misplaced = (!is_child).then(|| format!("{name} in {parent}"));
    let attributes = start.attributes().map(|attribute| attribute.unwrap().key.as_ref().to_vec());
    let attributes: Vec<String> = attributes.map(|key| String::from_utf8(key).unwrap()).collect();
    let [needed, further] = element(&name).map_or([&[][..], &[]], |element| element.attributes);
    let unknown = attributes.iter().filter(|key| !needed.contains(&key.as_str()) && !further.contains(&key.as_str()));
    let unknown = unknown.map(|key| format!("{name} has {key}"));
    let missing = needed.iter().filter(|key| !attributes.contains(&(**key).to_owned()));
    misplaced.into_iter().chain(unknown).chain(missing.map(|key| format!("{name} lacks {key}"))).collect()
}

#[test]
fn what_the_schema_refuses_is_found() {
    let text = "<testsuites skipped=\"0\"><testsuite name=\"a\" tests=\"1\" errors=\"0\"><testcase name=\"b\"><properties/>\
                </testcase></testsuite></testsuites>";
    assert_eq!(against_schema(text), ["testsuites has skipped", "testsuite lacks failures", "properties in testcase"]);
}

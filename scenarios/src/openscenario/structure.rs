//! Checks a document by the table of the standard, and replaces its parameters and expressions.
//!
//! ```text
//!  document ─▶ each element: children, attributes, values by `standard` ─▶ document with values only
//! ```
//!
//! An element or an attribute that the standard does not have at its place is refused: it would be
//! left out in silence. Each expression is computed once, however often the storyboard looks at it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::dom::{ImportError, Node};
use super::formula::Values;
use super::standard::{Element, Use, check_type, element_of};

/// The element that declares the parameters of the element around it.
const DECLARATIONS: &str = "ParameterDeclarations";

/// Values that are given from outside to the parameters of an element, by their names.
pub(super) type Given = BTreeMap<String, String>;

static NOTHING_GIVEN: Given = Given::new();

/// Replaces each attribute of an element, and of all inside it, by its value. `given` replaces
/// values of the parameters that the element itself declares. Returns notes on elements that are
/// left out.
///
/// # Errors
/// [`ImportError`] at the first element or attribute that the standard does not have there, or
/// whose value it does not allow.
pub(super) fn check(path: &Path, root: &mut Node, given: &Given) -> Result<Vec<String>, ImportError> {
    let mut checker = Checker { path, notes: Vec::new() };
    checker.element(root, &Values::default(), given)?;
    Ok(checker.notes)
}

struct Checker<'a> {
    path: &'a Path,
    notes: Vec<String>,
}

impl Checker<'_> {
    fn element(&mut self, node: &mut Node, outer: &Values<'_>, given: &Given) -> Result<(), ImportError> {
        // An element that is not in the table is refused by name where it is read.
        let Some(element) = element_of(&node.name) else { return Ok(()) };
        match element.usage {
            Use::Read => {}
            Use::Ignored => return Ok(()),
            Use::Noted(reason) => {
                self.notes.push(format!("line {}: `{}`: {reason}", node.line, node.name));
                return Ok(());
            }
        }
        self.check_children(node, element)?;
        self.replace_attributes(node, element, outer)?;
        let inner = self.declared(node, outer, given)?;
        let values = inner.as_ref().unwrap_or(outer);
        for child in node.children.iter_mut().filter(|child| child.name != DECLARATIONS) {
            self.element(child, values, &NOTHING_GIVEN)?;
        }
        Ok(())
    }

    fn check_children(&self, node: &Node, element: &Element) -> Result<(), ImportError> {
        let mut seen = BTreeSet::new();
        for child in &node.children {
            let Some(allowed) = element.children.iter().find(|allowed| allowed.trim_end_matches('*') == child.name)
            else {
                let names: Vec<_> = element.children.iter().map(|allowed| allowed.trim_end_matches('*')).collect();
                let allowed = if names.is_empty() { "none inside".to_owned() } else { names.join(", ") };
                let message = format!("it is no element of `{}`, which can have {allowed}", node.name);
                return Err(child.error(self.path, message));
            };
            if !allowed.ends_with('*') && !seen.insert(child.name.as_str()) {
                let message = format!("`{}` has one already, and can have only one", node.name);
                return Err(child.error(self.path, message));
            }
        }
        match node.text.trim() {
            "" => Ok(()),
            text => {
                let start: String = text.chars().take(40).collect();
                Err(node.error(self.path, format!("it holds the text `{start}`, and no text is allowed in it")))
            }
        }
    }

    fn replace_attributes(&self, node: &mut Node, element: &Element, values: &Values<'_>) -> Result<(), ImportError> {
        for index in 0..node.attributes.len() {
            let attribute = &node.attributes[index];
            if attribute.is_of_xml() {
                continue;
            }
            let Some(allowed) = element.attributes.iter().find(|allowed| allowed.name == attribute.key) else {
                let names: Vec<_> = element.attributes.iter().map(|allowed| allowed.name).collect();
                let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                let message = format!("`{}` is not an attribute of it, which can have {names}", attribute.key);
                return Err(node.error(self.path, message));
            };
            let value = allowed.checked(&attribute.value, values).map_err(|message| node.error(self.path, message))?;
            node.attributes[index].value = value;
        }
        Ok(())
    }

    /// Returns the values inside an element that declares parameters, or `None` if it declares
    /// none.
    fn declared<'v>(
        &mut self,
        node: &mut Node,
        outer: &'v Values<'v>,
        given: &Given,
    ) -> Result<Option<Values<'v>>, ImportError> {
        let Some(list) = node.children.iter_mut().find(|child| child.name == DECLARATIONS) else { return Ok(None) };
        if let Some(element) = element_of(DECLARATIONS) {
            self.check_children(list, element)?;
            self.replace_attributes(list, element, outer)?;
        }
        let mut values = Values::within(outer);
        for declaration in &mut list.children {
            let Some(element) = element_of(&declaration.name) else { continue };
            self.replace_attributes(declaration, element, &values)?;
            let [name, kind, value] = ["name", "parameterType", "value"].map(|attribute| {
                declaration
                    .raw(attribute)
                    .map(str::to_owned)
                    .ok_or_else(|| declaration.error(self.path, format!("it needs `{attribute}`")))
            });
            let (name, kind, value) = (name?, kind?, value?);
            let from_outside = given.get(&name).cloned();
            // The line is the one of the declaration, and a value from outside stands elsewhere.
            let origin = if from_outside.is_some() { ", whose value is given from outside" } else { "" };
            let value = from_outside.unwrap_or(value);
            check_type(&value, &kind)
                .map_err(|message| declaration.error(self.path, format!("the {kind} `{name}`{origin}: {message}")))?;
            if values.insert(name.clone(), value).is_some() {
                return Err(declaration.error(self.path, format!("a parameter `{name}` is declared before it already")));
            }
        }
        // A constraint can refer to a parameter that stands behind it.
        for declaration in &mut list.children {
            if let Some(element) = element_of(&declaration.name) {
                self.check_children(declaration, element)?;
            }
            for group in &mut declaration.children {
                self.element(group, &values, &NOTHING_GIVEN)?;
            }
            self.check_constraints(declaration, &values)?;
        }
        Ok(Some(values))
    }

    /// Checks that the value of a parameter keeps all constraints of one of its groups.
    fn check_constraints(&self, declaration: &Node, values: &Values<'_>) -> Result<(), ImportError> {
        if declaration.children.is_empty() {
            return Ok(());
        }
        let name = declaration.raw("name").unwrap_or_default();
        let value = values.get(name).unwrap_or_default();
        let attribute = |constraint: &Node, name: &str| constraint.raw(name).unwrap_or_default().to_owned();
        let is_kept = |constraint: &Node| keeps(value, &attribute(constraint, "rule"), &attribute(constraint, "value"));
        if declaration.children.iter().any(|group| group.children.iter().all(is_kept)) {
            return Ok(());
        }
        let groups: Vec<String> = declaration
            .children
            .iter()
            .map(|group| {
                let constraints = group.children.iter();
                let stated = constraints
                    .map(|constraint| format!("{} {}", attribute(constraint, "rule"), attribute(constraint, "value")));
                stated.collect::<Vec<_>>().join(" and ")
            })
            .collect();
        let message = format!("`{name}` is `{value}`, and its constraints are {}", groups.join(", or "));
        Err(declaration.error(self.path, message))
    }
}

/// Returns whether a value keeps a constraint. Values that are no numbers are the same or not.
fn keeps(value: &str, rule: &str, limit: &str) -> bool {
    let numbers = value.trim().parse::<f64>().ok().zip(limit.trim().parse::<f64>().ok());
    let Some((number, limit)) = numbers else {
        return match rule {
            "equalTo" => value == limit,
            "notEqualTo" => value != limit,
            _ => false,
        };
    };
    match rule {
        "equalTo" => number == limit,
        "notEqualTo" => number != limit,
        "greaterThan" => number > limit,
        "greaterOrEqual" => number >= limit,
        "lessThan" => number < limit,
        "lessOrEqual" => number <= limit,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::super::dom::parse;
    use super::*;

    fn checked(text: &str, given: &Given) -> Result<Node, String> {
        let path = Path::new("case.xosc");
        let mut root = parse(path, text).unwrap();
        check(path, &mut root, given).map_err(|error| error.to_string())?;
        Ok(root)
    }

    fn with_declarations(declarations: &str, story: &str) -> String {
        format!(
            "<OpenSCENARIO xmlns:xsi=\"x\" xsi:noNamespaceSchemaLocation=\"y\">\n\
             <ParameterDeclarations>{declarations}</ParameterDeclarations>\n\
             <Storyboard>{story}</Storyboard></OpenSCENARIO>"
        )
    }

    #[test]
    fn a_parameter_is_replaced_by_the_innermost_value() {
        let text = with_declarations(
            "<ParameterDeclaration name=\"v\" parameterType=\"string\" value=\"outer\"/>",
            "<Story name=\"$v\"><ParameterDeclarations><ParameterDeclaration name=\"v\" parameterType=\"string\" \
             value=\"inner\"/></ParameterDeclarations><Act name=\"$v\"/></Story>",
        );
        let name = |root: &Node, path: &[&str]| root.at(path).unwrap().raw("name").unwrap().to_owned();
        let root = checked(&text, &Given::new()).unwrap();
        assert_eq!(name(&root, &["Storyboard", "Story"]), "outer");
        assert_eq!(name(&root, &["Storyboard", "Story", "Act"]), "inner");
        let given = Given::from([("v".to_owned(), "given".to_owned())]);
        let root = checked(&text, &given).unwrap();
        assert_eq!(name(&root, &["Storyboard", "Story"]), "given");
        assert_eq!(name(&root, &["Storyboard", "Story", "Act"]), "inner");
    }

    #[test]
    fn a_value_outside_its_constraints_is_refused_with_them() {
        let limited = "<ParameterDeclaration name=\"a\" parameterType=\"double\" value=\"5\"><ConstraintGroup>\
                       <ValueConstraint rule=\"greaterThan\" value=\"1\"/>\
                       <ValueConstraint rule=\"lessThan\" value=\"$b\"/></ConstraintGroup></ParameterDeclaration>";
        let text = |value: &str| {
            let other = format!("<ParameterDeclaration name=\"b\" parameterType=\"double\" value=\"{value}\"/>");
            with_declarations(&format!("{limited}{other}"), "")
        };
        assert!(checked(&text("6"), &Given::new()).is_ok());
        let message = checked(&text("4"), &Given::new()).unwrap_err();
        assert!(message.contains("case.xosc:2: `ParameterDeclaration`"), "{message}");
        assert!(message.contains("`a` is `5`, and its constraints are greaterThan 1 and lessThan 4"), "{message}");
    }

    #[test]
    fn what_the_standard_does_not_have_is_refused_with_what_it_has() {
        let declaration = "<ParameterDeclaration name=\"a\" parameterType=\"double\" value=\"5\"/>";
        let story = |story: &str| with_declarations(declaration, story);
        let declared = |declarations: &str| with_declarations(declarations, "");
        for (text, word) in [
            (declared("<ParameterDeclaration title=\"a\"/>"), "`title` is not an attribute of it, which can have name"),
            (declared("<ParameterDeclaration name=\"a\" value=\"1\"/>"), "it needs `parameterType`"),
            (declared(&declaration.replace("double", "real")), "`parameterType` is `real`; one of boolean"),
            (declared(&declaration.replace('5', "five")), "the double `a`: `value` is `five`"),
            (declared(&declaration.repeat(2)), "`a` is declared before it already"),
            (story("<Story foo:name=\"a\"/>"), "`foo:name` is not an attribute of it"),
            (story("<Story name=\"a\">text</Story>"), "no text is allowed"),
            (story("<Init/><Init/>"), "`Init`: `Storyboard` has one already"),
            (story("<Story name=\"$b\"/>"), "there is no parameter `b`, only a"),
        ] {
            let message = checked(&text, &Given::new()).unwrap_err();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn what_is_left_out_is_noted() {
        let path = Path::new("case.xosc");
        let text = "<RoadNetwork><TrafficSignals/><SceneGraphFile filepath=\"$x\"/></RoadNetwork>";
        let mut root = parse(path, text).unwrap();
        assert_eq!(
            check(path, &mut root, &Given::new()).unwrap(),
            ["line 1: `TrafficSignals`: a scenario has no traffic signals"]
        );
    }
}

//! What is said of the nodes is true: the page in docs/ is what the table says, and every example in it can be read.

use seamount::format::{describe, describe_node, parse, plain};
use seamount::node::Registry;

#[test]
fn the_page_is_what_the_table_says() {
    let written = include_str!("../docs/scene-format.md");
    assert!(
        written == describe(&Registry::default()),
        "docs/scene-format.md is out of date: run `cargo run -- nodes --markdown > docs/scene-format.md`"
    );
}

#[test]
fn every_kind_has_an_example_that_reads() {
    for info in Registry::default().kinds() {
        let doc = plain(info.doc);
        let Some((_, rest)) = doc.split_once("```ron\n") else {
            // Its example is the scenes in scenes/.
            assert_eq!(info.kind, "SeamlessTerrain", "no example");
            continue;
        };
        let (example, _) = rest.split_once("```").expect("the end of the example");
        assert!(example.contains(info.kind), "{}", info.kind);
        let text = format!("Scene(version: 1, root: Separator(children: [{example}]))");
        parse(&text, &Registry::default()).unwrap_or_else(|e| panic!("{}: {e}", info.kind));
    }
}

#[test]
fn every_field_is_documented_and_reads_its_default() {
    for info in Registry::default().kinds() {
        assert!(!plain(info.doc).is_empty(), "{}", info.kind);
        for field in info.fields {
            assert!(!plain(field.doc).is_empty(), "{}.{}", info.kind, field.name);
            let mut node = (info.make)();
            (field.read)(node.as_mut(), &(field.default)())
                .unwrap_or_else(|e| panic!("{}.{}: {e:?}", info.kind, field.name));
            assert_eq!((field.write)(node.as_ref()), None, "{}.{}", info.kind, field.name);
        }
    }
}

#[test]
fn marks_of_rustdoc_are_left_out() {
    assert_eq!(
        plain(" As [`Cube`](crate::node::Cube), not [`Sphere`] or [text](url).\n\n More.\n"),
        "As `Cube`, not `Sphere` or [text](url).\n\nMore."
    );
    let registry = Registry::default();
    for info in registry.kinds() {
        assert!(!describe_node(info).contains("crate::"), "{}", info.kind);
    }
}

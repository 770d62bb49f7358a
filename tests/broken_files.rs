//! One broken file for each kind of mistake: where it is, in the file and in the tree, and what to do about it.

use seamount::format;
use seamount::node::Registry;

/// What is in the file, line and column, the path in the tree, and the part of the message that says what to do.
type Broken = (&'static str, [usize; 2], &'static [&'static str], &'static str);

const BROKEN: &[Broken] = &[
    ("Group(children: [\n  Cubs(),\n])", [2, 3], &["Group", "Cubs[0]"], "did you mean `Cube`?"),
    ("Group(children: [\n  Cube(widht: 1),\n])", [2, 8], &["Group", "Cube[0]"], "did you mean `width`?"),
    ("Group(children: [\n  Cube(width: \"1\"),\n])", [2, 15], &["Group", "Cube[0]"], "a number is expected here"),
    ("Group(children: [\n  Cube(width: NaN),\n])", [2, 15], &["Group", "Cube[0]"], "no field takes NaN"),
    ("Group(children: [\n  Cube(width: -1),\n])", [2, 15], &["Group", "Cube[0]"], "lengths go from 0 up"),
    ("Group(children: [\n  Cube(width: 1, width: 2),\n])", [2, 18], &["Group", "Cube[0]"], "take one away"),
    ("Group(children: [\n  Def(\"a\", Cube), Use(\"b\"),\n])", [2, 19], &["Group"], "did you mean \"a\"?"),
    ("Group(children: [\n  Use(\"a\"), Def(\"a\", Cube),\n])", [2, 3], &["Group"], "put the Def at the first place"),
    ("Group(children: [\n  Def(\"a\", Cube), Def(\"a\", Cube),\n])", [2, 23], &["Group"], "Use(\"a\") shares the node"),
    ("Group(children: [\n  Cube(children: []),\n])", [2, 8], &["Group", "Cube[0]"], "put it into a Separator"),
    ("Group(children: [\n  Texture2(filename: \"no.png\"),\n])", [2, 22], &["Group", "Texture2[0]"], "check the name"),
    (
        "Group(children: [\n  Font(name: \"Helvetica\"),\n])",
        [2, 14],
        &["Group", "Font[0]"],
        "\"defaultFont\", which is always there",
    ),
    #[cfg(unix)]
    ("Group(children: [\n  Font(name: \"/dev/null\"),\n])", [2, 14], &["Group", "Font[0]"], "it is no regular file"),
    ("Group(children: [\n  Text2(spacing: 1e308),\n])", [2, 18], &["Group", "Text2[0]"], "from -1000000 to 1000000"),
    ("Group(children: [\n  Cube Cube,\n])", [2, 8], &["Group"], "`,` or the closing bracket is expected here"),
    (
        "Group(children: [\n  Coordinate3(point: [(0, 0, 0)]),\n  IndexedFaceSet(coord_index: [0, 1, 2]),\n])",
        [3, 3],
        &["Group", "IndexedFaceSet[1]"],
        "refers to number 1 of the points: there are 1, from 0 to 0",
    ),
    (
        "Group(children: [\n  Coordinate3(point: [(0, 0, 0), (1, 0, 0), (0, 1, 0)]),\n  Normal(vector: [(0, 0, 1)]),\n  \
         FaceSet(num_vertices: [3]),\n])",
        [4, 3],
        &["Group", "FaceSet[2]"],
        "number 2 of the normals: there are 1, from 0 to 0",
    ),
];

#[test]
fn every_kind_of_mistake_says_where_it_is_and_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    for (number, (root, [line, column], path, advice)) in BROKEN.iter().enumerate() {
        let file = folder.path().join(format!("{number}.ron"));
        std::fs::write(&file, format!("Scene(version: 1, root: {root})")).unwrap();
        let error = format::check(&file, &Registry::default()).unwrap_err();
        let [mistake] = error.mistakes() else { panic!("{root}: {error}") };
        let position = mistake.position.unwrap_or_else(|| panic!("{root}: {error}"));
        assert_eq!(
            (&[position.line, position.column], mistake.path_in_tree.as_slice()),
            (&[*line, *column], path.iter().map(|p| (*p).to_owned()).collect::<Vec<_>>().as_slice()),
            "{root}: {error}"
        );
        assert!(mistake.problem.to_string().contains(advice), "{root}: {error}");
        assert!(error.to_string().starts_with(&format!("{}:{line}:{column}: ", file.display())), "{error}");
    }
}

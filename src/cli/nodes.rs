use seamount::format::{describe, describe_node, plain};
use seamount::node::{NodeInfo, Registry};
use serde::Serialize;

use super::{Failure, Outcome, Output};

/// List the kinds of node with their fields, or describe one.
///
/// From the same table that scene files are read with.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The kind to describe, such as Cube; all in short if not given.
    name: Option<String>,
    /// As JSON, for editors.
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// The whole language as a page of Markdown (docs/scene-format.md).
    #[arg(long, conflicts_with = "name")]
    markdown: bool,
}

#[derive(Debug, Serialize)]
struct NodeJson {
    kind: &'static str,
    family: &'static str,
    doc: String,
    children: Option<ChildrenJson>,
    actions: Vec<ActionsJson>,
    fields: Vec<FieldJson>,
}

/// What some actions do with the node; those that are not named pass it by.
#[derive(Debug, Serialize)]
struct ActionsJson {
    actions: Vec<&'static str>,
    text: &'static str,
}

#[derive(Debug, Serialize)]
struct ChildrenJson {
    field: &'static str,
    only: Option<&'static [&'static str]>,
}

#[derive(Debug, Serialize)]
struct FieldJson {
    name: &'static str,
    r#type: String,
    default: String,
    doc: String,
}

impl NodeJson {
    fn new(info: &NodeInfo) -> Self {
        Self {
            kind: info.kind,
            family: info.family,
            doc: plain(info.doc),
            children: info.children.map(|rule| ChildrenJson { field: rule.field, only: rule.only }),
            actions: info
                .actions
                .iter()
                .map(|note| ActionsJson {
                    actions: note.actions.iter().map(|action| action.name()).collect(),
                    text: note.text,
                })
                .collect(),
            fields: info
                .fields
                .iter()
                .map(|field| FieldJson {
                    name: field.name,
                    r#type: (field.type_name)(),
                    default: (field.default)(),
                    doc: plain(field.doc),
                })
                .collect(),
        }
    }
}

pub(super) fn run(args: &Args) -> Outcome {
    let registry = Registry::default();
    let mut out = Output::new();
    let chosen = match &args.name {
        None => None,
        Some(name) => Some(registry.get(name).ok_or_else(|| {
            let near = registry.nearest(name).map_or_else(String::new, |near| format!(", did you mean `{near}`?"));
            Failure::Usage(format!("there is no kind of node `{name}`{near}"))
        })?),
    };
    if args.markdown {
        out.line(format_args!("{}", describe(&registry).trim_end()))?;
    } else if args.json {
        let text = match chosen {
            Some(info) => serde_json::to_string_pretty(&NodeJson::new(info))?,
            None => serde_json::to_string_pretty(&registry.kinds().map(NodeJson::new).collect::<Vec<_>>())?,
        };
        out.line(format_args!("{text}"))?;
    } else if let Some(info) = chosen {
        out.line(format_args!("{}", describe_node(info).trim_end()))?;
    } else {
        let width = registry.kinds().map(|info| info.kind.len()).max().unwrap_or(0);
        for info in registry.kinds() {
            let doc = plain(info.doc);
            let first = doc.lines().next().unwrap_or_default();
            out.line(format_args!("{:width$}  {:8}  {first}", info.kind, info.family))?;
        }
    }
    out.flush()
}

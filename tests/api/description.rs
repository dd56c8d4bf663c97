//! The description in OpenAPI is that of the service: its routes, methods, parameters and documents.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use serde_json::Value;

use crate::harness::{common, program, scene};
use crate::schema_tools::{Random, value};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// What the program prints.
pub(crate) fn description() -> Value {
    let printed = program().arg("openapi").output().unwrap();
    assert!(printed.status.success());
    serde_json::from_slice(&printed.stdout).unwrap()
}

#[test]
fn the_description_is_printed_served_and_committed() {
    let printed = description();
    assert_eq!(printed["openapi"], "3.1.0");
    let committed: Value = serde_json::from_slice(&std::fs::read(root().join("docs/openapi.json")).unwrap()).unwrap();
    assert!(printed == committed, "docs/openapi.json is of another state; skyloom openapi >docs/openapi.json");
    let common = common();
    for path in ["/openapi.json", "/v1/openapi.json"] {
        let served = common.server.get(path);
        assert!(served.header("content-type").starts_with("application/json"));
        assert!(served.json() == printed, "{path}");
    }
    let schema = common.server.get("/v1/schema/scene.json");
    assert_eq!(schema.header("content-type"), "application/schema+json");
    assert_eq!(schema.json()["$schema"], "https://json-schema.org/draft/2020-12/schema");
}

/// The routes as the sources name them, without the files of the viewer.
fn routes() -> BTreeSet<String> {
    let mut found = BTreeSet::from(["/".to_owned()]);
    for file in ["api/src/routes.rs", "api/src/jobs/handlers.rs"] {
        let text = std::fs::read_to_string(root().join(file)).unwrap();
        let names = text.split(".route(\"").skip(1).map(|rest| rest.split('"').next().unwrap().to_owned());
        found.extend(names);
    }
    found
}

#[test]
fn every_route_and_method_is_described_and_nothing_else() {
    let document = description();
    let mut described: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (path, operations) in document["paths"].as_object().unwrap() {
        let methods = operations.as_object().unwrap().keys().map(|name| name.to_uppercase());
        described.insert(path.replace("{texture}.{format}", "{file}"), methods.collect());
    }
    assert_eq!(described.keys().cloned().collect::<BTreeSet<_>>(), routes());
    let common = common();
    for (path, mut methods) in described {
        let path = path.replace(['{', '}'], "");
        let answer = common.server.ask("PUT", &path, &[], b"");
        answer.problem(405);
        let allowed: BTreeSet<String> = answer.header("allow").split(',').map(str::to_owned).collect();
        if methods.contains("GET") {
            methods.insert("HEAD".to_owned());
        }
        assert_eq!(allowed, methods, "{path}");
    }
    let mut ids = BTreeSet::new();
    for operation in document["paths"].as_object().unwrap().values().flat_map(|path| path.as_object().unwrap().values())
    {
        assert!(ids.insert(operation["operationId"].to_string()), "{} twice", operation["operationId"]);
        for status in operation["responses"].as_object().unwrap().keys() {
            assert_ne!(status, "500", "a defect is no answer");
        }
    }
    // Whatever is referred to is there.
    let text = document.to_string();
    for name in text.split("\"#/components/schemas/").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        assert!(document["components"]["schemas"].get(name).is_some(), "{name}");
    }
}

/// Every parameter is known to the call that is said to have it, and takes the values that it is said to take; each call that has
/// parameters refuses others, and names all that there are.
#[test]
fn parameters_are_those_of_the_service() {
    let (document, common) = (description(), common());
    let sky = common.server.sky(&scene());
    let mut random = Random(5);
    for (path, operations) in document["paths"].as_object().unwrap() {
        let queried = |parameter: &&Value| parameter["in"] == "query";
        let parameters: Vec<&Value> =
            operations["get"]["parameters"].as_array().into_iter().flatten().filter(queried).collect();
        if parameters.is_empty() {
            continue;
        }
        let address = path.replace("/v1/skies/{id}", &sky).replace("{texture}.{format}", "sky.exr");
        let answer = common.server.get(&format!("{address}?nonsense=1&at=0,0"));
        let problem = answer.problem(422);
        let told = problem["errors"].as_array().unwrap().iter().find(|error| error["pointer"] == "nonsense").unwrap();
        let told = told["detail"].as_str().unwrap().rsplit("there are ").next().unwrap();
        let told: BTreeSet<&str> = told.split(", ").collect();
        // The version and, of a plan, the texture are taken off before.
        let mut named: BTreeSet<&str> = parameters
            .iter()
            .map(|parameter| parameter["name"].as_str().unwrap())
            .filter(|name| *name != "v")
            .collect();
        if path.ends_with("/plan") {
            named.remove("texture");
        }
        assert_eq!(told, named, "{path}");
        for parameter in parameters {
            let name = parameter["name"].as_str().unwrap();
            for _ in 0..12 {
                let made = value(&document, &parameter["schema"], &mut random);
                let text = match &made {
                    Value::String(text) => text.clone(),
                    Value::Array(list) => list[0].as_str().unwrap().to_owned(),
                    other => other.to_string(),
                };
                let query = form_urlencoded::Serializer::new(String::new()).append_pair(name, &text).finish();
                // Without any answer in full: a head renders nothing.
                let format = if ["coding", "mips"].contains(&name) { "ktx2" } else { "png" };
                let address = address.replace("sky.exr", &format!("sky.{format}"));
                let answer = common.server.get(&format!("{address}?{query}&nonsense=1"));
                let problem = answer.problem(422);
                let wrong = problem["errors"].as_array().unwrap().iter().find(|error| {
                    error["pointer"] == name
                        && error["detail"].as_str().unwrap().contains("not allowed; allowed")
                        // Bits go with the format.
                        && name != "depth"
                });
                assert!(wrong.is_none(), "{path} {query}: {wrong:?}");
            }
        }
    }
}

//! What configuration files say, and what was stored before there was more than one strategy.

mod common;

use std::collections::BTreeMap;

use ambulo_evolve::{Search, StrategySettings};
use common::{json_of, settings, started};
use serde_json::{Value, json};

/// As the arena reads them.
fn read(json: Value) -> Result<StrategySettings, String> {
    serde_path_to_error::deserialize(json!({"evolution": json}))
        .map(|mut file: BTreeMap<String, StrategySettings>| file.remove("evolution").unwrap())
        .map_err(|error| error.to_string())
}

#[test]
fn settings_come_back_as_they_were_stored() {
    for name in StrategySettings::NAMES {
        let mut wanted = settings(name);
        wanted.set_population(48);
        let stored = serde_json::to_value(&wanted).unwrap();
        assert_eq!((&stored["strategy"], &stored["population"]), (&json!(name), &json!(48)));
        assert_eq!(read(stored).unwrap(), wanted);
    }
}

#[test]
fn a_file_that_names_no_strategy_means_the_first_there_was() {
    assert_eq!(read(json!({})).unwrap(), StrategySettings::default());
    let old = read(json!({"population": 20, "selection": "windowed"})).unwrap();
    assert_eq!((old.name(), old.population()), ("genetic", 20));
    // A state from then.
    let mut state = serde_json::to_value(started("genetic", 1)).unwrap();
    state.as_object_mut().unwrap().remove("strategy");
    assert_eq!(serde_json::from_value::<Search>(state).unwrap(), started("genetic", 1));
}

#[test]
fn what_is_wrong_is_named() {
    let refused = |json: Value| read(json).unwrap_err();
    for (json, expected) in [
        (json!({"popluation": 3}), "evolution.popluation: unknown field `popluation`"),
        (json!({"population": "a"}), "evolution.population: invalid type: string \"a\""),
        (json!({"selection": "best"}), "evolution.selection: unknown variant `best`"),
        (json!({"strategy": "annealing"}), "evolution.strategy: unknown variant `annealing`"),
        (json!({"strategy": 3}), "evolution.strategy: invalid type: integer `3`"),
        (json!({"strategy": "cma_es", "covariance": "half"}), "evolution.covariance: unknown"),
        // A setting of another strategy.
        (json!({"elites": 3, "strategy": "es"}), "evolution: unknown field `elites`, expected"),
        (json!({"sigma": 0.5}), "evolution: unknown field `sigma`, expected"),
        (json!(3), "evolution: invalid type: integer `3`, expected a table of settings"),
    ] {
        let found = refused(json.clone());
        assert!(found.starts_with(expected), "{json}: {found}");
    }
    let twice = serde_json::from_str::<StrategySettings>(r#"{"population": 8, "population": 9}"#);
    assert!(twice.unwrap_err().to_string().starts_with("duplicate field `population`"));
    // Where the strategy comes first, the path is as long as it can be.
    let text = r#"{"strategy": "es", "elites": 3}"#;
    let mut from = serde_json::Deserializer::from_str(text);
    let error = serde_path_to_error::deserialize::<_, StrategySettings>(&mut from).unwrap_err();
    assert!(error.to_string().starts_with("elites: unknown field `elites`, expected"), "{error}");
}

#[test]
fn every_strategy_refuses_unknown_fields_and_states() {
    for name in StrategySettings::NAMES {
        let mut with = json_of(name);
        with["sigmma"] = json!(1);
        let error = read(with).unwrap_err();
        assert!(error.starts_with("evolution.sigmma: unknown field"), "{error}");
        let error = serde_json::from_value::<Search>(json!({"strategy": name})).unwrap_err();
        assert!(error.to_string().starts_with("missing field"), "{error}");
    }
    let error = serde_json::from_value::<Search>(json!({"strategy": "annealing"})).unwrap_err();
    assert!(error.to_string().contains("unknown variant `annealing`"), "{error}");
}

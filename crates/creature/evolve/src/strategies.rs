//! All strategies, by name: what is listed here can be asked for, is stored, and is tested.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, from_value};

use crate::cma_es::{CmaEs, CmaEsSettings};
use crate::es::{Es, EsSettings};
use crate::genetic::{Genetic, GeneticSettings};
use crate::map_elites::{MapElites, MapElitesSettings};
use crate::neat::{Neat, NeatSettings};
use crate::openai_es::{OpenaiEs, OpenaiEsSettings};
use crate::{EvolveError, Outcome, Strategy};

/// The field that names the strategy, and what it is where the field is missing.
const TAG: &str = "strategy";
const DEFAULT: &str = "genetic";

macro_rules! strategies {
    ($count:literal: $($name:literal is $kind:ident with $settings:ident,)*) => {
        /// Settings of a strategy, which the field `strategy` names; `genetic` if it is missing.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[serde(tag = "strategy")]
        #[allow(missing_docs)]
        pub enum StrategySettings { $(#[serde(rename = $name)] $kind($settings),)* }

        impl StrategySettings {
            /// The names of all strategies.
            pub const NAMES: [&'static str; $count] = [$($name),*];

            /// The name of the strategy.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$kind(_) => $name,)* }
            }

            /// Genomes of a generation; 0 where the strategy is to choose.
            pub fn population(&self) -> usize {
                match self { $(Self::$kind(settings) => settings.population,)* }
            }

            /// Asks for so many genomes of a generation.
            pub fn set_population(&mut self, population: usize) {
                match self { $(Self::$kind(settings) => settings.population = population,)* }
            }

            /// # Errors
            /// The first setting that is out of range.
            pub fn check(&self) -> Result<(), EvolveError> {
                match self { $(Self::$kind(settings) => settings.check(),)* }
            }

            /// The search at its start, for genomes of `genes` numbers; NEAT has its own idea of them.
            ///
            /// # Errors
            /// Settings out of range, no genes.
            pub fn start(&self, genes: usize, seed: u64) -> Result<Search, EvolveError> {
                match self {
                    $(Self::$kind(settings) => {
                        $kind::new(settings.clone(), genes, seed).map(Search::$kind)
                    })*
                }
            }

            fn read(name: &str, fields: Map<String, Value>) -> serde_json::Result<Self> {
                match name {
                    $($name => from_value(Value::Object(fields)).map(Self::$kind),)*
                    _ => Err(Error::unknown_variant(name, &Self::NAMES)),
                }
            }

            /// Whether the strategy of this name has a setting of that.
            fn knows(name: &str, field: &str) -> bool {
                let fields = match name {
                    $($name => serde_json::to_value($settings::default()),)*
                    _ => Ok(Value::Null),
                };
                fields.is_ok_and(|fields| fields.get(field).is_some())
            }
        }

        /// A strategy with its whole state, stored with the same field `strategy`.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[serde(tag = "strategy")]
        #[allow(missing_docs)]
        pub enum Search { $(#[serde(rename = $name)] $kind($kind),)* }

        impl Search {
            fn strategy(&self) -> &dyn Strategy {
                match self { $(Self::$kind(strategy) => strategy,)* }
            }

            fn strategy_mut(&mut self) -> &mut dyn Strategy {
                match self { $(Self::$kind(strategy) => strategy,)* }
            }

            /// The settings that it was started with.
            pub fn settings(&self) -> StrategySettings {
                match self {
                    $(Self::$kind(s) => StrategySettings::$kind(s.settings().clone()),)*
                }
            }

            fn read(name: &str, fields: Map<String, Value>) -> serde_json::Result<Self> {
                match name {
                    $($name => from_value(Value::Object(fields)).map(Self::$kind),)*
                    _ => Err(Error::unknown_variant(name, &StrategySettings::NAMES)),
                }
            }
        }
    };
}

strategies! { 6:
    "genetic" is Genetic with GeneticSettings,
    "es" is Es with EsSettings,
    "cma_es" is CmaEs with CmaEsSettings,
    "openai_es" is OpenaiEs with OpenaiEsSettings,
    "map_elites" is MapElites with MapElitesSettings,
    "neat" is Neat with NeatSettings,
}

impl Default for StrategySettings {
    /// The seed's genetic algorithm.
    fn default() -> Self {
        Self::Genetic(GeneticSettings::default())
    }
}

impl Search {
    /// How many generations were told.
    pub fn generation(&self) -> u64 {
        self.strategy().generation()
    }

    /// The genomes of this generation, whose outcome it wants to know.
    pub fn ask(&self) -> &[Vec<f32>] {
        self.strategy().ask()
    }

    /// Takes an outcome for each genome, in their order, and makes the next generation. What it
    /// refuses changes nothing.
    ///
    /// # Errors
    /// Another number of them than genomes; a behaviour that has not the numbers it needs.
    pub fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError> {
        self.strategy_mut().tell(outcomes)
    }

    /// Checks a state that was stored.
    ///
    /// # Errors
    /// Settings out of range, numbers that are not as many as they say, or not finite.
    pub fn check(&self) -> Result<(), EvolveError> {
        self.strategy().check()
    }

    /// The mean of the distribution that genomes are drawn from, where there is one.
    pub fn best_guess(&self) -> Option<&[f32]> {
        self.strategy().best_guess()
    }
}

impl<'de> Deserialize<'de> for Search {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let mut fields = Map::deserialize(from)?;
        // States from before there was more than one strategy name none.
        let name = fields.remove(TAG).unwrap_or(DEFAULT.into());
        Self::read(name.as_str().unwrap_or_default(), fields).map_err(D::Error::custom)
    }
}

impl<'de> Deserialize<'de> for StrategySettings {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_map(Table)
    }
}

/// Reads settings field by field though their kind may come last, so that whoever keeps track of paths
/// can name the field that is wrong.
struct Table;

impl<'de> Visitor<'de> for Table {
    type Value = StrategySettings;

    fn expecting(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str("a table of settings")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let (mut name, mut fields) = (None, Map::new());
        while let Some(field) = map.next_key::<String>()? {
            if field == TAG {
                name = Some(map.next_value_seed(Name)?);
            } else {
                let value = map.next_value_seed(Field { field: &field, of: name })?;
                if fields.insert(field.clone(), value).is_some() {
                    return Err(A::Error::custom(format!("duplicate field `{field}`")));
                }
            }
        }
        StrategySettings::read(name.unwrap_or(DEFAULT), fields).map_err(A::Error::custom)
    }
}

/// The name of a strategy.
struct Name;

impl<'de> DeserializeSeed<'de> for Name {
    type Value = &'static str;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Self::Value, D::Error> {
        let name = String::deserialize(from)?;
        let known = StrategySettings::NAMES.into_iter().find(|known| *known == name);
        known.ok_or_else(|| D::Error::unknown_variant(&name, &StrategySettings::NAMES))
    }
}

/// The value of a setting of the strategy, or of any of them as long as it is not known which.
struct Field<'a> {
    field: &'a str,
    of: Option<&'static str>,
}

impl<'de> DeserializeSeed<'de> for Field<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Value, D::Error> {
        let Self { field, of } = self;
        let value = Value::deserialize(from)?;
        let one =
            of.into_iter().chain(StrategySettings::NAMES.into_iter().filter(|_| of.is_none()));
        let mut refusal = None;
        for name in one.filter(|name| of.is_some() || StrategySettings::knows(name, field)) {
            let alone = Map::from_iter([(field.to_string(), value.clone())]);
            match StrategySettings::read(name, alone) {
                Ok(_) => return Ok(value),
                Err(error) => refusal = Some(error),
            }
        }
        Err(match refusal {
            Some(error) => D::Error::custom(error),
            None => D::Error::custom(format!("unknown field `{field}`: no strategy has it")),
        })
    }
}

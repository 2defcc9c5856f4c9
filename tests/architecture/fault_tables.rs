//! The tables of the documents that are generated from the catalogue of faults.

use std::collections::BTreeSet;

use icd::fault::{
    self, AirframePart, CATALOGUE, FailureType, KindInfo, Measure, NUMBERS_MAX, NumberInfo, Piece,
    Range, SensorKind, TargetClass, Targets,
};

use crate::sources::{assert_none, read, root};

use TargetClass::{Angle, Part, Thrust};

/// A sensor stands for all of them: which kinds they have does not differ.
const SENSOR: TargetClass = TargetClass::Sensor(SensorKind::Gnss);

/// If this variable is set, the test writes the tables instead of comparing them.
const WRITES: &str = "TWO_STEP_WRITE_DOCUMENTS";
const COMMAND: &str = "write them again: TWO_STEP_WRITE_DOCUMENTS=1 cargo test --workspace --test architecture fault_tables";

/// A document, a table in it, and the function that generates it. The table is between `<!-- faults: NAME ... -->` and `<!-- end -->`.
type Table = (&'static str, &'static str, fn() -> String);

const TABLES: [Table; 9] = [
    ("docs/faults.md", "kinds", kinds),
    ("docs/faults.md", "keys", keys),
    ("docs/faults.md", "sensors", sensors),
    ("docs/faults.md", "parts", parts),
    ("docs/commands.md", "types", types),
    ("docs/commands.md", "values", values),
    ("docs/faults.md", "types", types),
    ("docs/scripts.md", "words", words),
    ("docs/shell.md", "shell", shell),
];

#[test]
fn the_tables_of_faults_in_the_documents_are_those_of_the_catalogue() {
    let mut offences = Vec::new();
    for (path, name, table) in TABLES {
        let page = read(path);
        let head = format!("<!-- faults: {name}");
        let begin = page.find(&head).unwrap_or_else(|| panic!("{path} has no {head}"));
        let begin = begin + page[begin..].find("-->\n").expect("the comment ends") + 4;
        let end = begin + page[begin..].find("<!-- end -->").expect("the table ends");
        let table = table();
        if page[begin..end] == table {
            continue;
        }
        if std::env::var_os(WRITES).is_some() {
            let written = [&page[..begin], &table, &page[end..]].concat();
            std::fs::write(root().join(path), written).expect("documents can be written");
        } else {
            offences.push(format!("{path}: {name}"));
        }
    }
    assert_none(COMMAND, &offences);
}

/// A table from its headings and rows.
fn table<const N: usize>(heads: [&str; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut all = line(&heads.map(str::to_owned)) + &format!("|{}\n", "---|".repeat(N));
    rows.for_each(|row| all += &line(&row));
    all
}

/// The non-empty parts, joined, or else a dash.
fn joined(parts: impl IntoIterator<Item = String>, between: &str) -> String {
    let parts: Vec<String> = parts.into_iter().collect();
    if parts.is_empty() { "-".to_owned() } else { parts.join(between) }
}

fn code(word: &str) -> String {
    format!("`{word}`")
}

fn name(kind: &KindInfo) -> String {
    kind.key.replace('_', " ")
}

fn kinds() -> String {
    let rows = CATALOGUE.iter().map(|kind| {
        let codes = kind.code..kind.code + kind.alternatives();
        let numbers = kind
            .numbers
            .iter()
            .map(|number| format!("{} {}", number.quantity.name(), range(number)));
        let choice = kind.choice.iter().map(|choice| {
            let all = choice.alternatives.iter().map(|one| one.key.replace('_', " "));
            format!("{}: {}", choice.key, joined(all, " or "))
        });
        let targets = match kind.targets {
            Targets::EVERY => "all, and sensors",
            Targets::EFFECTORS => "all",
            Targets::SENSORS => "sensors",
            Targets::PARTS => "parts of the airframe",
            Targets { angles: true, .. } => "all but the engine",
            _ => "engine",
        };
        [
            code(kind.key),
            joined(codes.map(|code| code.to_string()), ", "),
            targets.to_owned(),
            joined(numbers.chain(choice), "; "),
            kind.servo.to_owned(),
            kind.acts.to_owned(),
            if kind.has_size() { kind.ramp.to_owned() } else { "-".to_owned() },
        ]
    });
    let heads =
        ["kind", "code", "of", "numbers and ranges", "what the servo does", "what acts", "ramp"];
    table(heads, rows)
}

fn range(number: &NumberInfo) -> String {
    let measure = number.quantity.measure();
    let [min, max] = number.range.anywhere(measure, Angle);
    match number.range {
        Range::Fixed(_) => format!("{min} to {max} {}", measure.unit(Angle).name),
        Range::Travel => "inside the travel".to_owned(),
        Range::HalfTravel => "up to half the travel".to_owned(),
        Range::HalfTravelEitherWay => "up to half the travel, either way".to_owned(),
        Range::UpToTravel => "0 to the end of the travel; engine: from idle".to_owned(),
        Range::Speed => "0.1 % to 100 % of the fastest speed".to_owned(),
        Range::SpeedEitherWay => "up to the fastest speed, either way".to_owned(),
    }
}

fn keys() -> String {
    let mut rows: Vec<[String; 3]> = Vec::new();
    let mut put = |keys: String, units: String, kind: &KindInfo| {
        let known = rows.iter_mut().find(|[known, ..]| *known == keys);
        match known {
            Some([.., kinds]) => *kinds += &format!(", {}", code(kind.key)),
            None => rows.push([keys, units, code(kind.key)]),
        }
    };
    for kind in &CATALOGUE {
        for number in kind.numbers {
            let (quantity, measure) = (number.quantity, number.quantity.measure());
            if kind.targets == Targets::SENSORS {
                continue;
            }
            let (keys, units) = if quantity.key(Angle) == quantity.key(Thrust) {
                (code(quantity.key(Angle)), measure.unit(Angle).name.to_owned())
            } else {
                let keys = [quantity.key(Angle), quantity.key(Thrust)].map(code);
                (
                    keys.join(", engine "),
                    [Angle, Thrust].map(|class| measure.unit(class).name).join(", "),
                )
            };
            put(keys, units, kind);
        }
        if let Some(choice) = kind.choice {
            let words = choice.alternatives.iter().map(|one| format!("`\"{}\"`", one.key));
            let default =
                choice.default.and_then(|place| choice.alternatives.get(usize::from(place)));
            let default =
                default.map_or(String::new(), |one| format!("; without it `\"{}\"`", one.key));
            put(
                format!("{} ({}{default})", code(choice.key), joined(words, ", ")),
                "-".to_owned(),
                kind,
            );
        }
    }
    table(["key", "unit", "kinds"], rows.into_iter())
}

fn sensors() -> String {
    let rows = SensorKind::ALL.into_iter().map(|sensor| {
        let (unit, word) = sensor.failure_unit();
        let [bias, rate, noise] = sensor.keys().map(code);
        let unit_of = |unit: fault::Unit| unit.name.to_owned();
        [
            code(sensor.key()),
            format!("{unit} `{word}`"),
            code(&format!("FLT_{}1", word.to_uppercase())),
            format!("{bias}, {noise}"),
            format!("{} up to {}", unit_of(sensor.unit()), sensor.largest()),
            rate,
            unit_of(sensor.unit_of_rate()),
        ]
    });
    let heads = [
        "sensor",
        "unit (p1), word",
        "parameter",
        "keys of bias and noise",
        "in",
        "key of drift",
        "in",
    ];
    table(heads, rows)
}

fn parts() -> String {
    let rows = AirframePart::ALL.into_iter().map(|part| {
        let parameter = format!("FLT_{}1", part.key().to_uppercase());
        [code(part.key()), format!("{} `{}`", part.failure_unit(), part.key()), code(&parameter)]
    });
    table(["part", "unit (p1), word", "parameter"], rows)
}

fn of_type(failure_type: FailureType) -> Vec<&'static KindInfo> {
    let of_type = CATALOGUE.iter().filter(|kind| kind.mavlink.failure_type == failure_type);
    let mut kinds: Vec<_> = of_type.collect();
    kinds.sort_by_key(|kind| kind.mavlink.first_mode);
    kinds
}

fn types() -> String {
    let rows = FailureType::ALL.into_iter().map(|failure_type| {
        let kinds = of_type(failure_type);
        let of = |class| {
            let all = kinds.iter().filter(|kind| kind.targets.allow(class));
            let mended =
                (failure_type == FailureType::Ok).then(|| "mended, nothing scheduled".to_owned());
            joined(mended.into_iter().chain(all.map(|kind| name(kind))), "; ")
        };
        let mode = failure_type.mode().map(|mode| code(mode.name));
        let parameters = kinds.iter().flat_map(|kind| {
            let choice = kind.choice.and_then(|choice| choice.parameter);
            let numbers = kind.numbers.iter().map(|number| code(number.parameter.name));
            numbers.chain(choice.map(|choice| code(choice.name)))
        });
        [
            failure_type.code().to_string(),
            failure_type.key().to_owned(),
            of(Angle),
            of(Thrust),
            of(SENSOR),
            of(Part),
            joined(mode.into_iter().chain(parameters), ", "),
        ]
    });
    table(["p2", "type", "servo", "motor", "sensor", "part", "by the parameters"], rows)
}

fn values() -> String {
    let mut kinds: Vec<_> =
        CATALOGUE.iter().filter_map(|kind| Some((kind.mavlink.user_1?, kind))).collect();
    kinds.sort_by_key(|(value, _)| *value);
    let rows = kinds.into_iter().map(|(value, kind)| {
        let failure_type = kind.mavlink.failure_type;
        let size = kind.size().map(|(_, number)| {
            let measure = number.quantity.measure();
            // Commands use seconds where texts use milliseconds.
            let unit = measure.unit(Angle).name;
            let unit = if unit == "ms" { "s" } else { unit };
            let mut engine = String::new();
            if measure.is_own() && kind.targets.thrust {
                engine += &format!("; engine {}", unit.replace("deg", "%"));
            }
            if measure.is_own() && kind.targets.sensors {
                engine += "; sensor: its unit";
            }
            let unit = match kind.targets == Targets::SENSORS {
                true => String::new(),
                false => format!(", {unit}"),
            };
            format!("{}{unit}{engine}", number.quantity.name())
        });
        let choice = kind.choice.iter().flat_map(|choice| choice.alternatives);
        let choice = choice.filter_map(|one| Some(format!("{} {}", one.value?.1, one.key)));
        [
            value.to_string(),
            format!("{} {}", failure_type.code(), failure_type.key()),
            name(kind),
            size.unwrap_or_else(|| joined(choice, ", ")),
        ]
    });
    table(["p4", "type (p2)", "kind", "p5"], rows)
}

fn words() -> String {
    let rows = CATALOGUE.iter().map(|kind| {
        let of = |class: TargetClass| {
            let alternatives = (0..kind.alternatives()).filter(|_| kind.targets.allow(class));
            joined(alternatives.map(|alternative| code(&example(kind, alternative, class))), ", ")
        };
        let others = kind.phrase.iter().filter_map(|piece| match piece {
            Piece::Words(words) => words.get(1..),
            _ => None,
        });
        let others = others.flatten().map(|words| format!(" (or `{words}`)"));
        let [angle, engine, sensor, part] = [Angle, Thrust, SENSOR, Part].map(of);
        let others = others.collect::<String>();
        let with = |text: String| if text == "-" { text } else { text + &others };
        [name(kind), with(angle), with(engine), with(sensor), with(part)]
    });
    table(["kind", "words", "for the engine", "for a sensor, here the gnss", "for a part"], rows)
}

/// A kind with the numbers of its parameters, as text.
fn example(kind: &KindInfo, alternative: u8, class: TargetClass) -> String {
    let mut values = [0.0; NUMBERS_MAX];
    for (value, number) in values.iter_mut().zip(kind.numbers) {
        let measure = number.quantity.measure();
        let default = if number.parameter.default == 0.0 { 30.0 } else { number.parameter.default };
        let default = match measure {
            Measure::Position if class == Thrust => 20.0,
            Measure::Speed if class == Thrust => 2.0,
            _ => default,
        };
        *value = measure.unit(class).to_si(default);
    }
    let kind = kind.with(alternative, values).expect("the alternatives are the kind's");
    kind.described(class).to_string()
}

fn shell() -> String {
    let units = |kind: &KindInfo| {
        let choice = kind.choice.iter().flat_map(|choice| choice.alternatives);
        let mut all: Vec<String> =
            choice.filter_map(|one| one.value).map(|(word, _)| code(word)).collect();
        for (number, measure) in
            kind.numbers.iter().map(|number| (number, number.quantity.measure()))
        {
            let units: BTreeSet<&str> = [Angle, Thrust, Part]
                .into_iter()
                .filter(|class| kind.targets.allow(*class))
                .map(|class| measure.unit(class).name)
                .collect();
            let mut units: Vec<&str> = units.into_iter().collect();
            if kind.targets.sensors && measure.is_own() {
                units.push("the unit of the sensor");
            }
            all.push(format!(
                "`{}` {} in {}",
                number.option,
                number.quantity.name(),
                units.join(", ")
            ));
        }
        joined(all, "; ")
    };
    let rows = FailureType::ALL.into_iter().flat_map(|failure_type| {
        let kinds = of_type(failure_type);
        let only = if let [only] = kinds[..] { units(only) } else { "-".to_owned() };
        let meaning = match &kinds[..] {
            [] => "mended".to_owned(),
            kinds => joined(kinds.iter().map(|kind| name(kind)), " or "),
        };
        let own = kinds
            .into_iter()
            .filter_map(|kind| Some([code(kind.mavlink.word?), name(kind), units(kind)]));
        let own: Vec<_> = own.collect();
        std::iter::once([code(failure_type.key()), meaning, only]).chain(own)
    });
    table(["type", "kind", "numbers"], rows)
}

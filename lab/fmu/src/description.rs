//! `modelDescription.xml` of FMI 3.0: variables with their units, and which outputs depend on what.

use std::fmt::Write as _;

use icd::units::STANDARD_GRAVITY_M_S2;

use crate::instance::FmuInstance;
use crate::variables::{Causality, FmuValue, FmuVariable};

/// Units by the last words of a name, the longest first: name, factor, and exponents of kg, m, s, A, rad.
const UNITS: [(&str, &str, f64, [i8; 5]); 11] = [
    ("kg_m3", "kg/m3", 1.0, [1, -3, 0, 0, 0]),
    ("rad_s2", "rad/s2", 1.0, [0, 0, -2, 0, 1]),
    ("rad_s", "rad/s", 1.0, [0, 0, -1, 0, 1]),
    ("rad", "rad", 1.0, [0, 0, 0, 0, 1]),
    ("m_s2", "m/s2", 1.0, [0, 1, -2, 0, 0]),
    ("m_s", "m/s", 1.0, [0, 1, -1, 0, 0]),
    ("m", "m", 1.0, [0, 1, 0, 0, 0]),
    ("n", "N", 1.0, [1, 1, -2, 0, 0]),
    ("pa", "Pa", 1.0, [1, -1, -2, 0, 0]),
    ("nt", "nT", 1.0e-9, [1, 0, -2, -1, 0]),
    ("pct", "%", 0.01, [0; 5]),
];
/// Units that no name ends with, or that need a number.
const OTHERS: [(&str, &str, f64, [i8; 5]); 2] =
    [("g", "g", STANDARD_GRAVITY_M_S2, [0, 1, -2, 0, 0]), ("time", "s", 1.0, [0, 0, 1, 0, 0])];

/// An FMU in its archive.
pub struct Description<'a> {
    pub model_name: &'a str,
    /// Name of the library.
    pub identifier: &'a str,
    pub token: &'a str,
    pub about: &'a str,
    pub duration_s: f64,
}

/// The unit at the end of a name.
fn unit_of(name: &str) -> Option<&'static str> {
    let has = |unit: &str| {
        name.strip_suffix(unit).is_some_and(|rest| rest.is_empty() || rest.ends_with('_'))
    };
    UNITS.iter().chain(&OTHERS).find(|(suffix, ..)| has(suffix)).map(|(_, unit, ..)| *unit)
}

impl Description<'_> {
    pub fn xml(&self, instance: &FmuInstance) -> String {
        let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        let [name, about] = [self.model_name, self.about].map(escaped);
        let (version, period_s) = (env!("CARGO_PKG_VERSION"), instance.period().as_seconds());
        let Self { identifier, token, duration_s, .. } = self;
        // Writing to a text cannot fail.
        let _ = write!(
            xml,
            r#"<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="{token}" description="{about}" version="{version}" generationTool="Two-Step {version}" variableNamingConvention="structured">
<CoSimulation modelIdentifier="{identifier}" canGetAndSetFMUState="true" canHandleVariableCommunicationStepSize="false" fixedInternalStepSize="{period_s}"/>
<UnitDefinitions>
"#
        );
        for (_, unit, factor, exponents) in UNITS.iter().chain(&OTHERS) {
            let _ = write!(xml, r#"<Unit name="{unit}"><BaseUnit"#);
            for (base, exponent) in ["kg", "m", "s", "A", "rad"].iter().zip(exponents) {
                if *exponent != 0 {
                    let _ = write!(xml, r#" {base}="{exponent}""#);
                }
            }
            let _ = writeln!(xml, r#" factor="{factor}"/></Unit>"#);
        }
        let _ = write!(
            xml,
            r#"</UnitDefinitions>
<LogCategories><Category name="{LOG_CATEGORY}" description="reasons of errors"/></LogCategories>
<DefaultExperiment startTime="0" stopTime="{duration_s}" stepSize="{period_s}"/>
<ModelVariables>
"#
        );
        let variables = || instance.variables().iter().zip(0_u32..);
        for (variable, reference) in variables() {
            entry(&mut xml, variable, reference);
        }
        xml.push_str("</ModelVariables>\n<ModelStructure>\n");
        // A step computes the outputs, so no input changes one at the same communication point.
        for (_, reference) in variables().filter(|(v, _)| v.causality == Causality::Output) {
            let _ = writeln!(xml, r#"<Output valueReference="{reference}" dependencies=""/>"#);
        }
        let known = |variable: &FmuVariable| {
            // Of the inputs only the wind acts at the start, by the trim.
            variable.causality == Causality::Parameter || variable.name.starts_with("wind_")
        };
        let knowns: Vec<String> =
            variables().filter(|(v, _)| known(v)).map(|(_, r)| r.to_string()).collect();
        let unknown = [Causality::Output, Causality::CalculatedParameter];
        for (_, reference) in variables().filter(|(v, _)| unknown.contains(&v.causality)) {
            let _ = writeln!(
                xml,
                r#"<InitialUnknown valueReference="{reference}" dependencies="{}"/>"#,
                knowns.join(" ")
            );
        }
        xml.push_str("</ModelStructure>\n</fmiModelDescription>\n");
        xml
    }
}

/// Category of the messages of errors.
pub const LOG_CATEGORY: &str = "logStatusError";

fn entry(xml: &mut String, variable: &FmuVariable, reference: u32) {
    let FmuVariable { name, causality, is_continuous, about, start } = variable;
    let element = match start {
        FmuValue::Number(_) => "Float64",
        FmuValue::Count(_) => "UInt64",
        FmuValue::Flag(_) => "Boolean",
        FmuValue::Text(_) => "String",
    };
    let causality_name = match causality {
        Causality::Independent => "independent",
        Causality::Parameter => "parameter",
        Causality::CalculatedParameter => "calculatedParameter",
        Causality::Input => "input",
        Causality::Output => "output",
    };
    let variability = match causality {
        Causality::Parameter | Causality::CalculatedParameter => "fixed",
        _ if *is_continuous => "continuous",
        _ => "discrete",
    };
    let _ = write!(
        xml,
        r#"<{element} name="{name}" valueReference="{reference}" causality="{causality_name}" variability="{variability}" description="{about}""#
    );
    if let (FmuValue::Number(_), Some(unit)) = (start, unit_of(name)) {
        let _ = write!(xml, r#" unit="{unit}""#);
    }
    let has_start = matches!(causality, Causality::Parameter | Causality::Input);
    let _ = match start {
        FmuValue::Number(number) if has_start => writeln!(xml, r#" start="{number}"/>"#),
        FmuValue::Count(count) if has_start => writeln!(xml, r#" start="{count}"/>"#),
        FmuValue::Flag(flag) if has_start => writeln!(xml, r#" start="{flag}"/>"#),
        FmuValue::Text(text) if has_start => {
            writeln!(xml, r#"><Start value="{}"/></{element}>"#, escaped(text))
        }
        _ => writeln!(xml, "/>"),
    };
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

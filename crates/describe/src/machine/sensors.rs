//! Lumped nodes, sensors, limits and measurements.

use super::channels::absolute;
use super::elastic::turned_name;
use super::geometry::{check_length, check_name, emissivity};
use super::keys::bodies::CAPACITY;
use super::keys::outputs::{GAIN, LAG, OFFSET, SURROUNDINGS_SHARE};
use super::names::{Index, lookup};
use super::parts::LumpedNode;
use super::readings::{MachineLimit, Measurement, Sensor, SensorReading};
use super::response::SensorResponse;
use super::shape::{origin, part_contains};
use super::symbols::Symbols;
use super::variables::{DescribedVariable, formula};
use coldplate_base::condition::AMBIENT_TEMPERATURE;
use coldplate_base::document::{Section, suggestion};
use coldplate_base::error::Result;
use coldplate_base::terms::LimitKind;
use coldplate_base::units::{Dimension, celsius};

/// Temperature below which a value is taken for a difference, K. Chosen: no limit of a machine is colder, no difference
/// of temperatures larger.
const COLDEST: f64 = 150.0;

/// Reads `[node.NAME]`.
pub(super) fn nodes(root: &Section<'_>, symbols: &Symbols) -> Result<Vec<LumpedNode>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("node")? {
        check_name(&name, &section)?;
        let capacity = CAPACITY.read(&section)?;
        if capacity < 0.0 {
            return Err(section
                .error_at("capacity", "a heat capacity cannot be negative")
                .help("leave it out for a node without capacity"));
        }
        let fixed = section.opt("temperature").map(|value| formula(&value, Dimension::TEMPERATURE, symbols)).transpose()?;
        let radiation = match section.one_of(&["emissivity", "effective_emissivity"])? {
            None => None,
            Some(key) => {
                let number = emissivity(&section.value(key)?)?;
                Some((number, key == "effective_emissivity", section.positive("area", Dimension::AREA)?))
            }
        };
        let start = section.opt("start").map(|value| formula(&value, Dimension::TEMPERATURE, symbols)).transpose()?;
        if start.is_some() && fixed.is_some() {
            return Err(section.error_at("start", "this node is held at its 'temperature' from the start").help("leave one of them out"));
        }
        section.finish()?;
        found.push(LumpedNode { name, capacity, fixed, radiation, start });
    }
    Ok(found)
}

/// Reads `[sensor.NAME]`.
pub(super) fn sensors(root: &Section<'_>, index: &Index<'_>) -> Result<Vec<Sensor>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("sensor")? {
        check_length(&name, &section)?;
        let kinds = ["point", "face", "part", "node", "inlet", "outlet"];
        let Some(kind) = section.one_of(&kinds)? else {
            let help =
                format!("give one of: {}; for example point = [\"10 mm\", \"0 mm\", \"5 mm\"] with in = \"plate\"", kinds.join(", "));
            return Err(section.error("this sensor reads nothing").help(help));
        };
        let value = section.value(kind)?;
        let reads = match kind {
            "point" => {
                let part = index.part(&section.value("in")?)?;
                let from = if absolute(&section)? { [0.0; 3] } else { origin(&index.parts[part]) };
                let at = value.triple(Dimension::LENGTH)?;
                let point: [f64; 3] = std::array::from_fn(|d| at[d] + from[d]);
                if !part_contains(&index.parts[part], point) {
                    let help = "coordinates are relative to the smallest corner of the part's first block (cylinders: the centre of its base; spheres: the centre; imported meshes: their own origin) unless coordinates = \"machine\"";
                    return Err(value.error(format!("this point lies outside the part '{}'", index.parts[part].name)).help(help));
                }
                SensorReading::Point(part, point)
            }
            "face" => SensorReading::FaceMean(index.face(&value)?),
            "part" => SensorReading::PartMean(index.part(&value)?),
            "node" => SensorReading::Node(index.node(&value)?),
            "inlet" => SensorReading::Inlet(index.channel(&value)?),
            _ => SensorReading::Outlet(index.channel(&value)?),
        };
        let shows = SensorResponse {
            surroundings: SURROUNDINGS_SHARE.read(&section)?,
            lag: LAG.read(&section)?,
            offset: OFFSET.read(&section)?,
            gain: GAIN.read(&section)?,
        };
        if !(0.0..1.0).contains(&shows.surroundings) {
            let error = section.error_at("surroundings_share", "a share lies between 0 and 1, and a sensor must feel its place");
            return Err(error.help("0.1 for one that is badly glued; leave it out for one that is at the temperature of its place"));
        }
        if shows.lag < 0.0 {
            return Err(section.error_at("lag", "a sensor cannot run ahead").help("leave it out for a sensor without lag"));
        }
        section.finish()?;
        found.push(Sensor { name, reads, shows });
    }
    Ok(found)
}

/// Reads `[limit.NAME]` over points with their dimensions.
pub(super) fn limits(root: &Section<'_>, points: &[(String, Dimension)], variables: &[DescribedVariable]) -> Result<Vec<MachineLimit>> {
    let mut found = Vec::new();
    let sensors: Vec<String> = points.iter().map(|(name, _)| name.clone()).collect();
    let sensors = sensors.as_slice();
    let difference = |of: &[usize]| points[of[0]].1.of_differences();
    for (name, section) in root.sections("limit")? {
        check_length(&name, &section)?;
        let several = |key: &str| -> Result<Vec<usize>> { section.list(key)?.iter().map(|v| lookup(v, sensors, "sensor")).collect() };
        let mut turned = None;
        let (kind, maximum) = match section.one_of(&["maximum", "magnitude", "rise", "difference", "spread"])? {
            Some("maximum") => {
                let point = lookup(&section.value("sensor")?, sensors, "sensor")?;
                let maximum = section.quantity("maximum", points[point].1)?;
                if points[point].1 == Dimension::TEMPERATURE && maximum < COLDEST {
                    let error =
                        section.error_at("maximum", format!("a maximum of {:.0} degC is colder than any machine", celsius(maximum)));
                    return Err(
                        error.help(format!("write it in degC; to limit the rise above another temperature, write rise = \"{maximum} K\""))
                    );
                }
                (LimitKind::Maximum { point }, maximum)
            }
            Some("magnitude") => {
                let (value, maximum) = (section.value("sensor")?, section.positive("magnitude", Dimension::LENGTH)?);
                let point = lookup(&value, sensors, "sensor")?;
                let Some(back) = sensors.iter().position(|other| *other == turned_name(&sensors[point])) else {
                    return Err(section
                        .error_at("sensor", "only the displacements of a machine file have a magnitude")
                        .help("limit its maximum"));
                };
                turned = Some(MachineLimit { name: turned_name(&name), kind: LimitKind::Maximum { point: back }, maximum });
                (LimitKind::Maximum { point }, maximum)
            }
            Some("rise") => {
                let point = lookup(&section.value("sensor")?, sensors, "sensor")?;
                let Some(variable) = variables.iter().position(|v| v.name == AMBIENT_TEMPERATURE) else {
                    return Err(section
                        .error_at("rise", "a rise is over the ambient temperature, which is no variable here")
                        .help("declare ambient_temperature under [variables], or limit the maximum"));
                };
                if !points[point].1.is_absolute() {
                    return Err(section
                        .error_at("sensor", "this point is no temperature, and a rise is over one")
                        .help("limit its maximum"));
                }
                (LimitKind::Rise { point, variable }, section.quantity("rise", Dimension::DIFFERENCE)?)
            }
            Some("difference") => {
                let both = several("between")?;
                let [first, second] = both[..] else {
                    return Err(section
                        .error_at("between", "two sensors are wanted here")
                        .help("the limit holds for the first minus the second"));
                };
                if first == second {
                    return Err(section.error_at("between", "the difference of a sensor to itself is zero").help("name two sensors"));
                }
                (LimitKind::Difference { first, second }, section.quantity("difference", difference(&both))?)
            }
            Some(_) => {
                let all = several("sensors")?;
                let repeated = all.iter().enumerate().any(|(i, sensor)| all[..i].contains(sensor));
                if all.len() < 2 || repeated {
                    return Err(section
                        .error_at("sensors", "two or more different sensors are wanted here")
                        .help("the spread is largest minus smallest"));
                }
                let spread = section.positive("spread", difference(&all))?;
                (LimitKind::Spread(all), spread)
            }
            None => {
                let help = "give sensor and maximum = \"30 degC\", rise = \"3 K\" or magnitude = \"20 um\", between and difference, or \
                            sensors and spread";
                return Err(section.error("this limit limits nothing").help(help));
            }
        };
        let of_points: Vec<usize> = match &kind {
            LimitKind::Difference { first, second } => vec![*first, *second],
            LimitKind::Spread(all) => all.clone(),
            LimitKind::Maximum { .. } | LimitKind::Rise { .. } => Vec::new(),
        };
        if of_points.iter().any(|point| points[*point].1 != points[of_points[0]].1) {
            return Err(section.error("the points of this limit are of different kinds").help("compare temperatures with temperatures"));
        }
        section.finish()?;
        found.push(MachineLimit { name, kind, maximum });
        found.extend(turned);
    }
    Ok(found)
}

/// Reads `[measurement.NAME]`.
pub(super) fn measurements(root: &Section<'_>, variables: &[DescribedVariable], sensors: &[Sensor]) -> Result<Vec<Measurement>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("measurement")? {
        let mut condition = Vec::new();
        if let Some(given) = section.opt_section("condition")? {
            for key in given.keys() {
                let value = given.value(key)?;
                let Some(at) = variables.iter().position(|v| v.name == key) else {
                    let known: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
                    return Err(value.error(format!("there is no variable '{key}'")).help(suggestion(key, &known)));
                };
                condition.push((at, value.quantity(variables[at].dimension)?));
            }
        }
        let temperatures = |key: &str| -> Result<Vec<(usize, f64)>> {
            let Some(given) = section.opt_section(key)? else { return Ok(Vec::new()) };
            let read = given.keys().map(|name| {
                let value = given.value(name)?;
                let known: Vec<&str> = sensors.iter().map(|s| s.name.as_str()).collect();
                let at = sensors.iter().position(|s| s.name == name);
                let at = at.ok_or_else(|| value.error(format!("there is no sensor '{name}'")).help(suggestion(name, &known)))?;
                let own = sensors[at].measurand();
                Ok((at, own.of_si(value.quantity(own.dimension())?)))
            });
            read.collect()
        };
        let (readings, others) = (temperatures("readings")?, temperatures("others")?);
        if readings.is_empty() {
            return Err(section.error_at("readings", "there are no readings").help("write readings = { \"SENSOR\" = \"42.2 degC\" }"));
        }
        let uncertainty = section.opt_positive("uncertainty", Dimension::DIFFERENCE)?;
        let note = section.opt_text("note")?.unwrap_or_default();
        section.finish()?;
        found.push(Measurement { name, condition, readings, others, uncertainty, note });
    }
    Ok(found)
}

//! The closed loop in your own program: plant and autopilot step by step, a fault at a time of your choice, and a copy of the flight
//! that goes on beside it with the same bits.
//!
//! `cargo run --release --example embed_loop`

use std::error::Error;

use autopilot::command::{Command, Intent};
use autopilot::recorder::Recorded;
use icd::FaultRequest;
use icd::fault::{FaultKind, PlantAction, Target, Timing, Travel};
use lab_engine::{Flight, SetupOptions};

pub fn main() -> Result<(), Box<dyn Error>> {
    // The same names, files and keys as `sitl fly nominal --law ndi --set plant.wind.turbulence_m_s=1`.
    let mut options = SetupOptions::default();
    options.set("CTL_LAW", 2.0).set("plant.wind.turbulence_m_s", 1.0);
    options.set("plant.duration_s", 20.0);
    let setup = options.setup("nominal")?;
    let elevator = setup.model.effectors.list.by_key("left_elevator").ok_or("no left elevator")?;

    let mut healthy = Flight::new(&setup)?;
    while healthy.next_time().as_seconds() < 5.0 {
        healthy.step([]);
    }

    // From here on two flights: one goes on, in the other the left elevator jams at 20 degrees.
    let mut jammed = healthy.copy()?;
    let request = FaultRequest::Inject {
        target: Target::Effector(elevator),
        kind: FaultKind::StuckAt {
            angle_rad: 20.0_f64.to_radians(),
            travel: Travel::AtActuatorRate,
        },
        timing: Timing::NOW,
    };
    let command = Command::Plant(PlantAction::Fault(request));
    let mut input = Some(Recorded::Intent(Intent { number: 1, command }));

    println!("   time  healthy: pitch rate   jammed: pitch rate  compensator");
    while let Some(tick) = jammed.step(input.take()) {
        let healthy_rad_s = match healthy.step([]) {
            Some(tick) => tick.plant.truth().body_rates.0.y,
            None => break,
        };
        if tick.exchange.step % 500 == 0 {
            println!(
                "{:5.1} s {:12.3} deg/s {:15.3} deg/s     {}",
                tick.exchange.time.as_seconds(),
                healthy_rad_s.to_degrees(),
                tick.plant.truth().body_rates.0.y.to_degrees(),
                if tick.log.compensator_active { "active" } else { "asleep" },
            );
        }
    }
    let end = jammed.end();
    println!(
        "the jammed aircraft {} after {:.1} s",
        if end.on_ground { "is on the ground" } else { "flies" },
        end.time.as_seconds()
    );
    Ok(())
}

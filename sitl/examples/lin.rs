//! t
fn main(){ let sc = plant_sim::Scenario::from_toml("n", plant_sim::scenario::NOMINAL).unwrap(); let s=sc.plant.setup(plant_sim::Airframe::paper(),0,icd::ControlPeriod::DEFAULT,1000); print!("{}", sitl::linearize::to_toml(&sitl::linearize::linearize(&s).unwrap()).unwrap()); }

//! What the full solver costs: `cargo bench --bench solver [MACHINE] [CELLS ...]`.
use std::time::Instant;
use coldplate::machine::Machine;
use coldplate::mesh::Mesh;
use coldplate::network::{Load, Network};
use coldplate::solve::Solver;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let machine = Machine::read(std::path::Path::new(&args[0]), &[]).unwrap();
    let condition = machine.condition(&[("coolant_flow", "9.42 L/min"), ("coolant_temperature", "20.5 degC"), ("motor_speed", "2500 rpm"), ("ambient_temperature", "23.5 degC")]).unwrap();
    for cells in args[1..].iter().map(|a| a.parse::<usize>().unwrap()) {
        let clock = Instant::now();
        let mesh = Mesh::with_cells(&machine, cells).unwrap();
        let t_mesh = clock.elapsed().as_secs_f64();
        let network = Network::build(&machine, &mesh).unwrap();
        let t_network = clock.elapsed().as_secs_f64() - t_mesh;
        let load = Load::at(&machine, &condition).unwrap();
        let solver = Solver::new(&network, &load).unwrap();
        let total = clock.elapsed().as_secs_f64();
        let (sizes, complexity) = solver.hierarchy();
        let s = solver.steady(&load).unwrap();
        println!("{} nodes: mesh {t_mesh:.2} network {t_network:.2} joints {} surfaces {}; assemble {:.2} solve {:.2}; newton {} krylov {}; total {total:.2}; {sizes:?} {complexity:.2}", network.nodes, network.joints.len(), network.surfaces.len(), s.assemble_seconds, s.solve_seconds, s.newton_iterations, s.krylov_iterations);
    }
}

//! What is built for the buck refuses another topology by its name.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use closed_loop::LoadStep;
use closed_loop::baselines::{Baseline, Kind};
use closed_loop::limit::{Question, averaged};
use closed_loop::time_optimal::TimeOptimal;
use plant::{Parameters, Topology};

#[test]
fn designs_limits_and_plans_of_the_buck_refuse_other_topologies() {
    let step = LoadStep::from([200.0, 500.0]);
    for topology in [Topology::Boost, Topology::BuckBoost] {
        let mut p = Parameters::paper_model();
        p.converter.topology = topology;
        let mut said: Vec<String> = Kind::ALL
            .iter()
            .map(|kind| Baseline::new(*kind, &p, 300.0).unwrap_err().to_string())
            .collect();
        said.push(Question::new(&p, 300.0, step, [0.0, 1.0]).unwrap_err().to_string());
        said.push(averaged(&p, 300.0, step, [0.0, 1.0]).unwrap_err().to_string());
        said.push(TimeOptimal::new(&p, 300.0, [0.0, 1.0]).unwrap_err().to_string());
        for said in said {
            assert!(
                said.contains("for the buck converter alone") && said.contains(topology.word()),
                "{said}"
            );
        }
    }
}

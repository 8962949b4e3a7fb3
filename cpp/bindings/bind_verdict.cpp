#include <pybind11/stl.h>

#include "bindings/bind.hpp"
#include "debulk/verdict/excess_bounds.hpp"
#include "debulk/verdict/judge.hpp"

namespace debulk {

namespace py = pybind11;

namespace {

void bind_judgement(py::module_ m) {
  py::enum_<Verdict>(m, "Verdict")
      .value("CEASE", Verdict::cease)
      .value("UNDECIDED", Verdict::undecided)
      .value("CREASE", Verdict::crease)
      .value("INVALID", Verdict::invalid);

  py::enum_<Criterion>(m, "Criterion").value("EXCESS", Criterion::excess).value("PAPER", Criterion::paper);

  py::class_<Judgement>(m, "Judgement")
      .def(py::init<>())
      .def_readwrite("verdict", &Judgement::verdict)
      .def_readwrite("reason", &Judgement::reason)
      .def_readonly("decided_by", &Judgement::decided_by);

  py::class_<JudgedPocket>(m, "JudgedPocket")
      .def(py::init<>())
      .def_readwrite("id", &JudgedPocket::id)
      .def_readwrite("judgement", &JudgedPocket::judgement);
}

void bind_evidence(py::module_ m) {
  py::class_<Criteria>(m, "Criteria")
      .def(py::init<>())
      .def_readwrite("criterion", &Criteria::criterion)
      .def_readwrite("max_rms_mm", &Criteria::max_rms)
      .def_readwrite("max_ridge_height_mm", &Criteria::max_ridge_height)
      .def_readwrite("min_coverage", &Criteria::min_coverage)
      .def_readwrite("min_pocket_coverage", &Criteria::min_pocket_coverage)
      .def_readwrite("rms_margin_mm", &Criteria::rms_margin)
      .def_readwrite("ridge_margin_mm", &Criteria::ridge_margin)
      .def_readwrite("compliance_margin_mm", &Criteria::compliance_margin)
      .def("check", &Criteria::check);

  py::class_<Spread>(m, "Spread")
      .def(py::init([](double low, double high) { return Spread{low, high}; }), py::arg("low"), py::arg("high"))
      .def_readonly("low", &Spread::low)
      .def_readonly("high", &Spread::high);

  py::class_<PocketEvidence>(m, "PocketEvidence")
      .def(py::init<>())
      .def_readwrite("inside_ply", &PocketEvidence::inside_ply)
      .def_readwrite("excess_ridge", &PocketEvidence::excess_ridge)
      .def_readwrite("rms", &PocketEvidence::rms)
      .def_readwrite("ridge_height", &PocketEvidence::ridge_height)
      .def_readwrite("bridge_height", &PocketEvidence::bridge_height)
      .def_readwrite("certified", &PocketEvidence::certified)
      .def_readwrite("compliant", &PocketEvidence::compliant)
      .def_readwrite("solve_status", &PocketEvidence::solve_status)
      .def_readwrite("deadline_passed", &PocketEvidence::deadline_passed)
      .def_readwrite("coverage", &PocketEvidence::coverage)
      .def_readwrite("closed_rim", &PocketEvidence::closed_rim)
      .def_readwrite("refused", &PocketEvidence::refused);
}

void bind_excess(py::module_ m) {
  py::class_<RidgeBounds>(m, "RidgeBounds")
      .def_readonly("least_mm", &RidgeBounds::least)
      .def_readonly("geometric_mm", &RidgeBounds::geometric)
      .def_readonly("elastic_mm", &RidgeBounds::elastic);
  m.def("excess_bounds", &excess_bounds, py::arg("excess_length_mm"), py::arg("thickness_mm"), py::arg("bulk_factor"),
        py::arg("natural_length_mm"));
  m.def("natural_length", &natural_length, py::arg("modulus_mpa"), py::arg("thickness_mm"), py::arg("pressure_mpa"));
}

}  // namespace

void bind_verdict(py::module_ m) {
  bind_judgement(m);
  bind_evidence(m);
  bind_excess(m);
  m.def("judge", &judge, py::arg("evidence"), py::arg("criteria"));
  m.def("judge_layup", &judge_layup, py::arg("pockets"), py::arg("coverage"), py::arg("criteria"));
}

}  // namespace debulk

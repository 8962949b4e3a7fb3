#pragma once

#include <pybind11/pybind11.h>

namespace debulk {

// One function per room (folder of cpp/debulk). module.cpp calls each with its submodule, in the order of the rooms.
void bind_build(pybind11::module_ m);
void bind_scanner(pybind11::module_ m);
void bind_cloud(pybind11::module_ m);
void bind_files(pybind11::module_ m);
void bind_surface(pybind11::module_ m);
void bind_pocket(pybind11::module_ m);
void bind_fibre(pybind11::module_ m);
void bind_net(pybind11::module_ m);
void bind_solve(pybind11::module_ m);
void bind_sheet(pybind11::module_ m);
void bind_ridge(pybind11::module_ m);
void bind_section(pybind11::module_ m);
void bind_verdict(pybind11::module_ m);

}  // namespace debulk

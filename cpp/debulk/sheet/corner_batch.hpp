#pragma once

namespace debulk {

// A corner is a node with two of its neighbours; its energy is a function of the angle between u = x_a - x_node and
// v = +-(x_b - x_node). A batch holds several corners, coordinate by coordinate, so that the compiler can vectorise
// over them.
struct CornerBatch {
  static constexpr int capacity = 64;
  using Lane = double[capacity];

  alignas(64) Lane u[3], v[3];
  alignas(64) Lane value;
  alignas(64) Lane by_u[3], by_v[3];    // gradient
  alignas(64) Lane by_uu[6], by_vv[6];  // Hessian: xx, xy, xz, yy, yz, zz
  alignas(64) Lane by_uv[9];            // rows u, columns v, row by row
};

enum class Order { value, gradient, hessian };

// Compute stiffness * theta^2 and stiffness * (pi/2 - theta)^2, with derivatives up to `order`, for the first `count`
// corners. The functions are compiled for several instruction sets, and one version is chosen at run time. All versions
// do the same operations in the same order, without fused multiply-add, so that their results agree in every bit.
void turning_batch(CornerBatch& batch, int count, double stiffness, Order order);
void shear_batch(CornerBatch& batch, int count, double stiffness, Order order);

}  // namespace debulk

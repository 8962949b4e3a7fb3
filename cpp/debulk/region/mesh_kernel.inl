// The inner loop of mesh_pass.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// Processes one row of the mesh; `b` has room for 16 values before and behind the row.
void run(const MeshRow& in, MeshBuffers& b, MeshRowSums& out) {
  constexpr int margin = 16;
  const int padded = (in.width + lanes - 1) / lanes * lanes;
  float* x = b.x.data() + margin;
  float* y = b.y.data() + margin;
  float* z = b.z.data() + margin;
  for (int k = 0; k < padded; k += lanes) {
    Floats vx, vy, vz;
    if (k + lanes <= in.width) {
      load_points(in.xyz + 3 * static_cast<std::size_t>(k), vx, vy, vz);
    } else {
      for (int i = 0; i < lanes; ++i) {
        const bool there = k + i < in.width;
        const float* p = in.xyz + 3 * static_cast<std::size_t>(there ? k + i : 0);
        vx[i] = there ? p[0] : nan, vy[i] = p[1], vz[i] = p[2];
      }
    }
    const Floats sum = vx + vy + vz;
    vx = choose(sum - sum == 0, vx, all(nan));
    if (in.masked) {
      for (int i = 0; i < lanes && k + i < in.width; ++i)
        if (in.masked[k + i]) vx[i] = nan;
    }
    store(x + k, vx), store(y + k, vy), store(z + k, vz);
  }
  x[padded] = nan;  // an earlier, longer row may have left a value here
  const float inverse = 1 / static_cast<float>(in.base_step);
  for (int k = 0; k < padded; k += in.base_step) {
    const int i = std::min(k / in.base_step, in.base_nx - 2);
    const float left = in.depth[i] + in.t * (in.depth_below[i] - in.depth[i]);
    const float right = in.depth[i + 1] + in.t * (in.depth_below[i + 1] - in.depth[i + 1]);
    const float gain = in.gain[i] + in.t * (in.gain_below[i] - in.gain[i]);
    const float gain_right = in.gain[i + 1] + in.t * (in.gain_below[i + 1] - in.gain[i + 1]);
    for (int m = 0; m < in.base_step; ++m) {
      const float w = static_cast<float>(m) * inverse;
      b.base[static_cast<std::size_t>(k + m)] = left + w * (right - left);
      b.gain[static_cast<std::size_t>(k + m)] = gain + w * (gain_right - gain);
    }
  }

  const Floats v = all(in.v), slack = all(in.slack), reach = all(in.reach * in.reach), high = all(in.high), clamp = all(in.clamp);
  Ints seen_all = {}, strays = {};
  Floats left = all(infinity), right = all(-infinity);
  const auto near = [&](int k) DEBULK_LAMBDA {
    const Floats dx = load(x + k) - load(x + k + 1), dy = load(y + k) - load(y + k + 1), dz = load(z + k) - load(z + k + 1);
    return dx * dx + dy * dy + dz * dz <= reach;
  };
  for (int k = 0; k < padded; k += lanes) {
    const Floats px = load(x + k), py = load(y + k), pz = load(z + k);
    const Ints seen = px == px;
    const Ints placed = (absolute(px - load(in.u + k) * pz) <= slack * pz) & (absolute(py - v * pz) <= slack * pz);
    seen_all += seen, strays += seen & ~placed;
    left = lower(px, left), right = higher(px, right);
    const Floats height = (pz - load(b.base.data() + k)) * load(b.gain.data() + k);
    const Ints known = seen & (height == height);
    const Ints steady = known & (near(k) | near(k - 1));
    const Floats one = choose(steady, all(1), all(0)), h = choose(steady, height, all(0));
    Floats count = one + swapped<1>(one), sum = h + swapped<1>(h);
    count = count + swapped<2>(count), sum = sum + swapped<2>(sum);
    const Floats mean = choose(count >= all(2), sum / count, all(nan));
    for (int c = 0; c < lanes / 4; ++c) in.cells[k / 4 + c] = mean[4 * c];
    in.tile_count[k / lanes] += total(one);
    in.tile_sum[k / lanes] += total(choose(steady, lower(higher(height, -clamp), clamp), all(0)));
    const Ints above = known & (height >= high);
    if (!any(above)) continue;
    for (int i = 0; i < lanes; ++i)
      if (above[i]) out.high.push_back(k + i);
  }
  out.across = highest(right) - lowest(left);
  int count[2][lanes];
  write(count[0], seen_all), write(count[1], strays);
  for (int i = 0; i < lanes; ++i) out.seen -= count[0][i], out.strays -= count[1][i];
}

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "bindings/bind.hpp"
#include "bindings/cloud_view.hpp"
#include "bindings/convert.hpp"
#include "debulk/files/file_fault.hpp"
#include "debulk/files/lzf.hpp"
#include "debulk/files/ply_elements.hpp"
#include "debulk/files/point_records.hpp"
#include "debulk/files/point_summary.hpp"
#include "debulk/files/text_points.hpp"

// The fast readers of points that debulk.formats needs. NumPy allocates the memory, because it asks for large pages.
namespace debulk {
namespace {

// Runs body without the GIL. A FileFault is rethrown as Python's exception `fault`, with the arguments (byte, problem).
template <class Body>
auto reading(const py::handle& fault, const Body& body) {
  try {
    py::gil_scoped_release release;
    return body();
  } catch (const FileFault& error) {
    py::set_error(fault, py::make_tuple(error.byte(), error.what()));
    throw py::error_already_set();
  }
}

py::tuple to_tuple(const PointSummary& s) {
  return py::make_tuple(s.low, s.high, s.at_origin);
}

using TypeNames = std::array<std::string, 3>;

std::array<NumberType, 3> types_of(const TypeNames& names) {
  return {number_type(names[0]), number_type(names[1]), number_type(names[2])};
}

py::array_t<float> new_points(long count) {
  return py::array_t<float>({static_cast<py::ssize_t>(count), py::ssize_t{3}});
}

float* checked_out(py::array_t<float>& out, long count) {
  const bool fits = out.ndim() == 2 && out.shape(1) == 3 && out.shape(0) == count && (out.flags() & py::array::c_style);
  require(fits, "out", "a C-contiguous (count, 3) array", shape_of(out));
  return out.mutable_data();
}

}  // namespace

void bind_files(py::module_ m) {
  const py::object fault = py::exception<FileFault>(m, "FileFault");

  m.def(
      "read_records",
      [fault](int file, long long offset, long record_bytes, const std::array<long, 3>& offsets, const TypeNames& types, bool big_endian,
              double factor, py::array_t<float> out, int threads) {
        const long count = out.ndim() > 0 ? static_cast<long>(out.shape(0)) : 0;
        float* const points = checked_out(out, count);
        const RecordLayout layout{record_bytes, offsets, types_of(types), big_endian};
        return to_tuple(reading(fault, [&] { return read_records(file, offset, count, layout, factor, points, threads); }));
      },
      py::arg("file"), py::arg("offset"), py::arg("record_bytes"), py::arg("offsets"), py::arg("types"), py::arg("big_endian"),
      py::arg("factor"), py::arg("out").noconvert(), py::arg("threads"));

  m.def(
      "read_compressed",
      [fault](const py::array_t<std::uint8_t>& compressed, py::array_t<std::uint8_t> columns, const std::array<long long, 3>& offsets,
              const TypeNames& names, double factor, py::array_t<float> out, int threads) {
        const long count = out.ndim() > 0 ? static_cast<long>(out.shape(0)) : 0;
        float* const points = checked_out(out, count);
        const bool flat = compressed.ndim() == 1 && columns.ndim() == 1 && (compressed.flags() & columns.flags() & py::array::c_style);
        require(flat, "columns", "a flat array, as the compressed one", shape_of(columns));
        const auto size = static_cast<long long>(columns.size());
        const std::array<NumberType, 3> types = types_of(names);
        for (std::size_t k = 0; k < 3; ++k) {
          const bool inside = offsets[k] >= 0 && offsets[k] <= size - static_cast<long long>(count) * bytes_of(types[k]);
          require(inside, "offsets", "columns inside the data", offsets[k]);
        }
        const std::uint8_t* const in = compressed.data();
        const auto in_bytes = static_cast<std::size_t>(compressed.size());
        std::uint8_t* const unpacked = columns.mutable_data();
        return to_tuple(reading(fault, [&] {
          decompress_lzf(in, in_bytes, unpacked, static_cast<std::size_t>(size));
          return gather_columns({unpacked + offsets[0], unpacked + offsets[1], unpacked + offsets[2]}, types, count, factor, points,
                                threads);
        }));
      },
      py::arg("compressed").noconvert(), py::arg("columns").noconvert(), py::arg("offsets"), py::arg("types"), py::arg("factor"),
      py::arg("out").noconvert(), py::arg("threads"));

  m.def(
      "scale_and_summarise",
      [fault](py::array_t<float> points, double factor, int threads) {
        const long count = points.ndim() > 0 ? static_cast<long>(points.shape(0)) : 0;
        float* const values = checked_out(points, count);
        return to_tuple(reading(fault, [&] { return scale_and_summarise(values, count, factor, threads); }));
      },
      py::arg("points").noconvert(), py::arg("factor"), py::arg("threads"));

  m.def(
      "read_text",
      [fault](int file, long long begin, long long end, long first_line, int columns, const std::array<int, 3>& xyz,
              const std::string& separator, bool comments, long most_rows, double factor, int threads) -> py::tuple {
        require(separator.size() == 1, "separator", "one character", separator);
        const TextLayout layout{columns, xyz, separator[0], comments};
        const TextPoints text = reading(fault, [&] { return TextPoints(file, begin, end, first_line, layout, threads); });
        const long rows = most_rows < 0 ? text.rows() : std::min(most_rows, text.rows());
        if (most_rows > rows) return py::make_tuple(text.rows(), py::none(), py::none());  // too few rows: nothing is read
        py::array_t<float> out = new_points(rows);
        float* const points = out.mutable_data();
        const PointSummary summary = reading(fault, [&] { return text.read(rows, factor, points); });
        return py::make_tuple(text.rows(), out, to_tuple(summary));
      },
      py::arg("file"), py::arg("begin"), py::arg("end"), py::arg("first_line"), py::arg("columns"), py::arg("xyz"), py::arg("separator"),
      py::arg("comments"), py::arg("most_rows"), py::arg("factor"), py::arg("threads"));

  m.def(
      "read_elements",
      [fault](int file, long long begin, long long end, const std::vector<std::tuple<std::string, std::string, int>>& properties,
              bool big_endian, py::array_t<double> out) {
        require(out.ndim() == 2 && (out.flags() & py::array::c_style), "out", "a C-contiguous (count, columns) array", shape_of(out));
        PlyElement element{{}, static_cast<long>(out.shape(0)), static_cast<int>(out.shape(1)), big_endian};
        for (const auto& [type, length, column] : properties) {
          PlyProperty property{number_type(type), std::nullopt, column};
          if (!length.empty()) property.length = number_type(length);
          element.properties.push_back(property);
        }
        double* const values = out.mutable_data();
        return reading(fault, [&] { return read_elements(file, begin, end, element, values); });
      },
      py::arg("file"), py::arg("begin"), py::arg("end"), py::arg("properties"), py::arg("big_endian"), py::arg("out").noconvert());

  m.attr("MAX_LZF_RATIO") = max_lzf_ratio;
}

}  // namespace debulk

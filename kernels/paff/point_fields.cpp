#include "kernels/paff/point_fields.h"

#include <sstream>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 512;

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

Result<PointFields> evaluate_fields(const ShapeFunctions& shape, std::span<const Vec3> points,
                                    bool with_gradients) {
  struct Part {
    PointFields fields;
    std::ptrdiff_t singular = -1;
    std::size_t reached = 0;
  };
  std::vector<Part> parts((points.size() + kChunk - 1) / kChunk);
  parallel_chunks(points.size(), kChunk, [&](std::size_t first, std::size_t last) {
    Part& part = parts[first / kChunk];
    PointFields& fields = part.fields;
    ShapeValues at_point;
    for (std::size_t q = first; q < last; ++q) {
      if (!shape.evaluate(points[q], with_gradients, at_point)) {
        part.singular = static_cast<std::ptrdiff_t>(q);
        part.reached = at_point.nodes.size();
        return;
      }
      append(fields.nodes, at_point.nodes);
      append(fields.values, at_point.values);
      append(fields.weights, at_point.weights);
      append(fields.gradients, at_point.gradients);
      fields.begin.push_back(fields.nodes.size());
    }
  });

  PointFields all;
  std::size_t entries = 0;
  for (const Part& part : parts) entries += part.fields.nodes.size();
  all.begin.reserve(points.size() + 1);
  all.nodes.reserve(entries);
  all.values.reserve(entries);
  all.weights.reserve(entries);
  if (with_gradients) all.gradients.reserve(entries);
  for (Part& part : parts) {
    if (part.singular >= 0) {
      const Vec3 at = points[static_cast<std::size_t>(part.singular)] * 1e3;
      std::ostringstream message;
      message << "nodes: " << part.reached << " nodes reach (" << at.transpose()
              << ") mm and carry no " << (shape.basis() == Basis::kLinear ? "linear" : "quadratic")
              << " field there; expected at least " << basis_terms(shape.basis())
              << ", not in one plane: use a smaller node spacing";
      return failure(message.str());
    }
    const std::size_t base = all.nodes.size();
    for (std::size_t q = 1; q < part.fields.begin.size(); ++q) {
      all.begin.push_back(base + part.fields.begin[q]);
    }
    append(all.nodes, part.fields.nodes);
    append(all.values, part.fields.values);
    append(all.weights, part.fields.weights);
    append(all.gradients, part.fields.gradients);
    part.fields = PointFields();
  }
  return all;
}

NodeIncidence::NodeIncidence(const PointFields& fields, std::size_t node_count)
    : begin_(node_count + 1, 0), entries_(fields.nodes.size()) {
  for (const int node : fields.nodes) ++begin_[static_cast<std::size_t>(node) + 1];
  for (std::size_t i = 0; i < node_count; ++i) begin_[i + 1] += begin_[i];
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t q = 0; q < fields.points(); ++q) {
    for (std::size_t e = fields.begin[q]; e < fields.begin[q + 1]; ++e) {
      entries_[next[static_cast<std::size_t>(fields.nodes[e])]++] = {static_cast<int>(q), e};
    }
  }
}

}  // namespace viscera

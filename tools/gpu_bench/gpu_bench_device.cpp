#include "tools/gpu_bench/gpu_bench_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

namespace viscera {
namespace {

constexpr int kMostRepeats = 20;

}  // namespace

Result<BenchDevice> open_bench_device(int window_mb, int repeats) {
  Result<std::unique_ptr<EglContext>> context = EglContext::create();
  if (!context) return std::unexpected(context.error());
  std::cout << "device: " << (*context)->device()
            << ((*context)->software() ? " (a software driver: figures say nothing of a GPU)" : "")
            << '\n';
  const std::size_t window = static_cast<std::size_t>(window_mb) * 1'000'000;
  const Result<MemoryBandwidth> memory =
      measure_memory_bandwidth(window, window, std::min(repeats, kMostRepeats));
  if (!memory) return std::unexpected(memory.error());
  std::cout << fmt::format("memory: reads {:.1f} GB/s, copies {:.1f} GB/s ({} MB at a time)\n",
                           1e-9 * memory->read, 1e-9 * memory->copy, memory->bytes / 1'000'000);
  return BenchDevice{*std::move(context), *memory};
}

Result<void> write_bench_json(const std::string& path, const nlohmann::ordered_json& report) {
  std::filesystem::path temporary = path;
  temporary += ".tmp";
  std::ofstream file(temporary);
  file << report.dump(2) << '\n';
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(temporary, path, error);
  if (!file || error) return failure(path + ": can't be written");
  return {};
}

}  // namespace viscera

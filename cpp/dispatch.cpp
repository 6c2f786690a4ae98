#include "dispatch.hpp"

#include <atomic>
#include <stdexcept>

namespace kinverse {
namespace {

std::atomic<int> threads{1};

const Kernels* widest() { return available_kernels().back(); }

std::atomic<const Kernels*>& active() {
  static std::atomic<const Kernels*> kernels{widest()};
  return kernels;
}

}  // namespace

std::vector<const Kernels*> available_kernels() {
  std::vector<const Kernels*> sets{&baseline::KERNELS};
#if defined(KINVERSE_X86)
  __builtin_cpu_init();
  bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (has_avx2) sets.push_back(&avx2::KERNELS);
  if (has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    sets.push_back(&avx512::KERNELS);
#endif
  return sets;
}

const Kernels& active_kernels() { return *active().load(std::memory_order_relaxed); }

const Kernels& latency_kernels() {
  const Kernels& kernels = active_kernels();
#if defined(KINVERSE_X86)
  if (&kernels == &avx512::KERNELS) return avx2::KERNELS;
#endif
  return kernels;
}

void set_active_kernels(const std::string& name) {
  std::string known;
  for (const Kernels* kernels : available_kernels()) {
    if (name == kernels->name) {
      active().store(kernels);
      return;
    }
    known += std::string(known.empty() ? "" : ", ") + kernels->name;
  }
  throw std::invalid_argument("instruction set '" + name + "' is not available; this machine has: " + known);
}

int thread_count() { return threads.load(std::memory_order_relaxed); }

long parts_of(long count, long least_part) {
  const long most = count / least_part, threads_now = thread_count();
  return most < 1 || threads_now < 2 ? 1 : most < threads_now ? most : threads_now;
}

void set_thread_count(int count) {
  if (count < 1 || count > 1024) throw std::invalid_argument("threads must lie in 1..1024");
  threads.store(count);
}

}  // namespace kinverse

#!/bin/sh
# rltools 2.2.1, evaluate_step of a GRU, which is for inference:
# 1. An output tensor whose numbers are in the object (static allocation, as on a microcontroller) stays as it was: the function writes to a copy of it.
# 2. The state is forgotten every SEQUENCE_LENGTH steps, a number of the training's input shape. NoAutoResetMode keeps it; it is not the default.
# Seen on 2026-11-29:  static output 0.00000, state 0.18800; with sequence length 4 and constant input, step 5 equals step 1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps rltools==2.2.1
include=$(echo v/lib/python3*/site-packages/rltools/external/rl_tools/include)
cat > gru.cpp <<'CPP'
#include <rl_tools/operations/cpu.h>
#include <rl_tools/nn/layers/gru/operations_generic.h>
#include <cmath>
#include <cstdio>
namespace rlt = rl_tools;
namespace gru = rlt::nn::layers::gru;
using Device = rlt::devices::DefaultCPU;
using TI = Device::index_t;
using Types = rlt::numeric_types::Policy<float>;
using Layer = gru::Layer<gru::Configuration<Types, TI, 8>, rlt::nn::capability::Forward<false>, rlt::tensor::Shape<TI, 4, 1, 3>>;
template <TI N, bool DYNAMIC>
using Row = rlt::Tensor<rlt::tensor::Specification<float, TI, rlt::tensor::Shape<TI, 1, N>, DYNAMIC>>;

static Device device;
static Device::SPEC::RANDOM::ENGINE<> rng;
static Layer layer;
static Layer::State<false> state;
static Layer::Buffer<false> buffer;
static Row<3, false> input;

template <typename Mode>
float change(const char *name, const Mode &mode) {
    Row<8, true> output;
    rlt::malloc(device, output);
    rlt::reset(device, layer, state, rng);
    float first = 0, last = 0;
    for (int step = 1; step <= 5; step++) {
        rlt::evaluate_step(device, layer, input, state, output, buffer, rng, mode);
        last = rlt::get(device, output, 0, 0);
        first = step == 1 ? last : first;
        std::printf("%s, step %d: %.5f\n", name, step, last);
    }
    return std::fabs(first - last);
}

int main() {
    rlt::set_all(device, layer.weights_input.parameters, 0.3f);
    rlt::set_all(device, layer.weights_hidden.parameters, 0.2f);
    rlt::set_all(device, layer.biases_input.parameters, 0.1f);
    rlt::set_all(device, layer.biases_hidden.parameters, 0.1f);
    rlt::set_all(device, layer.initial_hidden_state.parameters, 0.0f);
    rlt::set_all(device, input, 0.5f);
    Row<8, false> output;
    rlt::set_all(device, output, 0.0f);
    rlt::reset(device, layer, state, rng);
    rlt::evaluate_step(device, layer, input, state, output, buffer, rng);
    float given = rlt::get(device, output, 0, 0), kept = rlt::get(device, state.state, 0, 0);
    std::printf("static output %.5f, state %.5f\n", given, kept);
    float usual = change("default", rlt::Mode<rlt::mode::Default<>>{});
    float without = change("NoAutoResetMode", rlt::Mode<gru::NoAutoResetMode<rlt::mode::Default<>>>{});
    return !(given == 0 && kept > 0.01f && usual < 1e-6f && without > 0.01f);
}
CPP
c++ -std=c++17 -O1 -w -I "$include" gru.cpp -o gru && ./gru

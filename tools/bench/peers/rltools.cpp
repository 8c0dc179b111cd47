// RLtools' layers in f32, with its device for Arm. Weights stay in flash.
#include <rl_tools/operations/arm.h>

#include <rl_tools/nn/layers/dense/operations_arm/opt.h>
#include <rl_tools/nn/layers/gru/operations_generic.h>

#include "f32.h"

namespace rlt = rl_tools;
using Device = rlt::devices::DefaultARM;
using TI = Device::index_t;
using Types = rlt::numeric_types::Policy<float>;
using Capability = rlt::nn::capability::Forward<true>;

static Device device;
static Device::SPEC::RANDOM::ENGINE<> rng;

template <typename Parameters>
static void point(Parameters &parameters, const float *values) {
    parameters._data = const_cast<float *>(values);
}

#ifdef GRU
namespace gru = rlt::nn::layers::gru;
using Layer = gru::Layer<gru::Configuration<Types, TI, OUTPUTS>, Capability, rlt::tensor::Shape<TI, 1000, 1, INPUTS>>;
static Layer layer;
static Layer::State<false> state;
static Layer::Buffer<false> buffer;
// Not in the tensor: findings/rltools-gru-step.sh.
static float values[OUTPUTS];
static rlt::Tensor<rlt::tensor::Specification<float, TI, rlt::tensor::Shape<TI, 1, OUTPUTS>, true>> output;
static const float initial[OUTPUTS] = {};

void peer_init() {
    point(layer.weights_input.parameters, wx);
    point(layer.biases_input.parameters, bx);
    point(layer.weights_hidden.parameters, wh);
    point(layer.biases_hidden.parameters, bh);
    point(layer.initial_hidden_state.parameters, initial);
    point(output, values);
    rlt::reset(device, layer, state, rng);
}

void peer_step(unsigned step) {
    rlt::Tensor<rlt::tensor::Specification<float, TI, rlt::tensor::Shape<TI, 1, INPUTS>, true>> in;
    point(in, &input[step * INPUTS]);
    rlt::evaluate_step(device, layer, in, state, output, buffer, rng, rlt::Mode<gru::NoAutoResetMode<rlt::mode::Default<>>>{});
}

uint32_t peer_output(unsigned index) { return bits_of(values[index]); }
#else
static float values[2][WIDEST];

template <TI ROWS, TI COLS, auto FUNCTION>
static void evaluate(const float *in, const float *weights, const float *bias, float *out) {
    namespace dense = rlt::nn::layers::dense;
    using Layer = dense::Layer<dense::Configuration<Types, TI, ROWS, FUNCTION>, Capability, rlt::tensor::Shape<TI, 1, 1, COLS>>;
    Layer layer;
    point(layer.weights.parameters, weights);
    point(layer.biases.parameters, bias);
    rlt::Matrix<rlt::matrix::Specification<float, TI, 1, COLS, true>> from;
    rlt::Matrix<rlt::matrix::Specification<float, TI, 1, ROWS, true>> to;
    point(from, in);
    point(to, out);
    dense::Buffer buffer;
    rlt::evaluate(device, layer, from, to, buffer, rng);
}

void peer_init() {}

void peer_step(unsigned step) {
    using namespace rlt::nn::activation_functions;
    const float *in = &input[step * INPUTS];
#if LAYERS == 1
    evaluate<256, 256, IDENTITY>(in, weights_0, bias_0, values[0]);
#else
    evaluate<512, 48, RELU>(in, weights_0, bias_0, values[0]);
    evaluate<256, 512, RELU>(values[0], weights_1, bias_1, values[1]);
    evaluate<128, 256, RELU>(values[1], weights_2, bias_2, values[0]);
    evaluate<12, 128, IDENTITY>(values[0], weights_3, bias_3, values[1]);
#endif
}

uint32_t peer_output(unsigned index) { return bits_of(values[(LAYERS - 1) % 2][index]); }
#endif

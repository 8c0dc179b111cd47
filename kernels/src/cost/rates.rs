//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [100.319, 186.657, 100.319], // a step, with its operations and its action aside
    [10.498, 13.496, 10.498], // a value of the observation
    [271.562, 409.177, 271.562], // an action
    [22.601, 38.938, 22.601], // a value of the action
    [8.935, 10.661, 9.857], // a value of an array of the action contract
    [83.922, 176.983, 83.922], // a call that runs one operation
    [0.000, 0.000, 83.922], // a call that runs pieces
    [0.000, 0.000, 33.832], // an operation that a poll comes to
    [0.000, 0.000, 244.796], // a piece
    [433.165, 778.654, 433.165], // a linear operation
    [0.000, 0.000, 980.284], // a block of rows of a linear operation that a poll comes to
    [26.986, 36.959, 26.986], // eight values compared by magnitude
    [9.676, 13.100, 9.676], // a value compared by magnitude
    [256.489, 419.673, 256.489], // a block of rows whose order is looked at
    [48.345, 85.066, 48.345], // a linear operation that sets its output up before the rows are added
    [1.462, 3.116, 1.462], // an output set to 0 before the rows are added
    [3.886, 5.943, 3.886], // an output set to its bias before the rows are added
    [154.788, 235.947, 154.788], // a block of rows in order, whole strips
    [144.865, 251.804, 144.865], // a block of rows with sums on the stack
    [95.099, 125.810, 95.099], // a run of rows with sums on the stack
    [57.294, 105.503, 57.294], // eight rows scaled by the assembler
    [31.125, 42.393, 31.125], // a row in order scaled
    [34.466, 50.875, 34.466], // a row with an index scaled
    [284.572, 479.834, 284.572], // a normalization
    [24.506, 28.504, 24.591], // a value normalized
    [303.912, 532.885, 303.912], // a layer norm
    [17.763, 25.512, 17.763], // a value of a layer norm
    [259.201, 473.060, 259.201], // an RMS norm
    [10.251, 12.496, 10.251], // a value of an RMS norm
    [215.889, 390.037, 215.889], // an addition
    [5.248, 6.746, 5.248], // a value added
    [215.680, 389.973, 215.680], // a copy
    [2.749, 4.249, 2.749], // a value copied
    [284.573, 524.593, 284.573], // an LSTM cell
    [204.937, 378.800, 204.995], // an element of an LSTM cell
    [304.298, 545.701, 304.298], // a GRU cell
    [134.971, 246.912, 134.998], // an element of a GRU cell
    [179.919, 350.188, 179.919], // a function's operation
    [8.065, 9.057, 8.278], // an element of relu
    [20.918, 32.788, 34.187], // an element of elu
    [38.047, 74.336, 38.187], // an element of silu
    [68.006, 119.514, 68.065], // an element of gelu
    [45.048, 86.330, 45.187], // an element of gelu_tanh
    [48.010, 86.025, 48.065], // an element of tanh
    [38.047, 74.336, 38.187], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [793.668, 1330.782, 793.668], // 2 bits single rows prepared: a chunk
    [92.339, 121.371, 92.339], // 2 bits single rows prepared: a chunk written by itself
    [32.159, 46.281, 32.159], // 2 bits single rows prepared: eight values
    [16.287, 22.384, 16.287], // 2 bits single rows prepared: a value of the rest
    [1.713, 3.322, 1.713], // 2 bits single rows prepared: a pair of padding
    [688.810, 1175.525, 688.810], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [120.960, 184.575, 120.960], // 2 bits single groups prepared: a chunk
    [109.862, 155.970, 109.862], // 2 bits single groups prepared: a chunk written by itself
    [32.750, 47.681, 32.750], // 2 bits single groups prepared: eight values
    [10.601, 11.111, 10.601], // 2 bits single groups prepared: a value of the rest
    [0.000, 0.052, 0.000], // 2 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [803.070, 1374.117, 803.070], // 2 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a chunk
    [130.546, 205.395, 130.546], // 2 bits paired rows prepared: a chunk written by itself
    [39.454, 54.454, 39.454], // 2 bits paired rows prepared: eight values
    [10.292, 8.718, 10.292], // 2 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a pair of padding
    [675.723, 1224.268, 675.723], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [85.718, 155.365, 85.718], // 2 bits paired groups prepared: a chunk
    [122.826, 148.449, 122.826], // 2 bits paired groups prepared: a chunk written by itself
    [45.800, 59.194, 45.800], // 2 bits paired groups prepared: eight values
    [5.839, 4.843, 5.839], // 2 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [788.373, 1319.233, 788.373], // 3 bits single rows prepared: a chunk
    [93.584, 124.686, 93.584], // 3 bits single rows prepared: a chunk written by itself
    [32.200, 46.353, 32.200], // 3 bits single rows prepared: eight values
    [15.782, 21.247, 15.782], // 3 bits single rows prepared: a value of the rest
    [1.750, 3.350, 1.750], // 3 bits single rows prepared: a pair of padding
    [688.950, 1175.208, 688.950], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [121.219, 185.085, 121.219], // 3 bits single groups prepared: a chunk
    [110.153, 157.159, 110.153], // 3 bits single groups prepared: a chunk written by itself
    [32.758, 47.690, 32.758], // 3 bits single groups prepared: eight values
    [10.654, 11.047, 10.654], // 3 bits single groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [813.661, 1401.167, 813.661], // 3 bits paired rows prepared: a group
    [48.271, 65.349, 48.271], // 3 bits paired rows prepared: a chunk
    [67.160, 93.426, 67.160], // 3 bits paired rows prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: eight values
    [13.201, 19.779, 13.201], // 3 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a pair of padding
    [674.220, 1223.837, 674.220], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [76.117, 108.973, 76.117], // 3 bits paired groups prepared: a chunk
    [30.769, 40.245, 30.769], // 3 bits paired groups prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: eight values
    [11.172, 11.285, 11.172], // 3 bits paired groups prepared: a value of the rest
    [8.974, 13.288, 8.974], // 3 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [789.023, 1322.493, 789.023], // 4 bits single rows prepared: a chunk
    [96.396, 126.988, 96.396], // 4 bits single rows prepared: a chunk written by itself
    [32.151, 46.247, 32.151], // 4 bits single rows prepared: eight values
    [15.173, 20.610, 15.173], // 4 bits single rows prepared: a value of the rest
    [1.436, 2.960, 1.436], // 4 bits single rows prepared: a pair of padding
    [689.088, 1175.541, 689.088], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [120.976, 184.781, 120.976], // 4 bits single groups prepared: a chunk
    [109.907, 156.829, 109.907], // 4 bits single groups prepared: a chunk written by itself
    [32.750, 47.673, 32.750], // 4 bits single groups prepared: eight values
    [10.694, 11.154, 10.694], // 4 bits single groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [770.909, 1273.064, 770.909], // 4 bits paired rows prepared: a group
    [124.140, 237.200, 124.140], // 4 bits paired rows prepared: a chunk
    [30.888, 40.627, 30.888], // 4 bits paired rows prepared: a chunk written by itself
    [37.060, 51.372, 37.060], // 4 bits paired rows prepared: eight values
    [12.148, 15.528, 12.148], // 4 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a pair of padding
    [668.298, 1216.856, 668.298], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [158.913, 263.970, 158.913], // 4 bits paired groups prepared: a chunk
    [45.587, 35.780, 45.587], // 4 bits paired groups prepared: a chunk written by itself
    [48.749, 62.894, 48.749], // 4 bits paired groups prepared: eight values
    [5.208, 4.049, 5.208], // 4 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [795.291, 1324.902, 795.291], // 8 bits single rows prepared: a chunk
    [71.778, 96.325, 71.778], // 8 bits single rows prepared: a chunk written by itself
    [32.040, 45.961, 32.040], // 8 bits single rows prepared: eight values
    [16.316, 21.146, 16.316], // 8 bits single rows prepared: a value of the rest
    [2.717, 4.405, 2.717], // 8 bits single rows prepared: a pair of padding
    [689.318, 1175.356, 689.318], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [121.075, 185.297, 121.075], // 8 bits single groups prepared: a chunk
    [110.033, 157.344, 110.033], // 8 bits single groups prepared: a chunk written by itself
    [32.751, 47.662, 32.751], // 8 bits single groups prepared: eight values
    [10.790, 11.331, 10.790], // 8 bits single groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [797.660, 1325.966, 797.660], // 8 bits paired rows prepared: a group
    [15.970, 64.659, 15.970], // 8 bits paired rows prepared: a chunk
    [114.432, 158.008, 114.432], // 8 bits paired rows prepared: a chunk written by itself
    [32.302, 46.328, 32.302], // 8 bits paired rows prepared: eight values
    [9.968, 12.540, 9.968], // 8 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a pair of padding
    [665.077, 1213.153, 665.077], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [79.001, 135.969, 79.001], // 8 bits paired groups prepared: a chunk
    [126.406, 158.858, 126.406], // 8 bits paired groups prepared: a chunk written by itself
    [43.072, 59.489, 43.072], // 8 bits paired groups prepared: eight values
    [5.033, 2.795, 5.033], // 8 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a pair of padding
    [62.151, 132.036, 62.151], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a pass or group of a strip
    [8.483, 7.676, 8.483], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.499, 5.434, 4.499], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [75.999, 161.538, 75.999], // 2 bits single groups, 4 rows: a call
    [7.826, 9.277, 7.826], // 2 bits single groups, 4 rows: a strip
    [26.382, 44.956, 26.382], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.502, 5.437, 4.502], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [89.063, 182.718, 89.063], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [32.036, 49.121, 32.036], // 2 bits paired rows, 4 rows: a chunk of a strip
    [1.499, 2.064, 1.499], // 2 bits paired rows, 4 rows: a column of a strip
    [83.158, 178.847, 83.158], // 2 bits paired rows, 8 rows: a call
    [24.025, 32.163, 24.025], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [17.990, 39.748, 17.990], // 2 bits paired rows, 8 rows: a chunk of a strip
    [4.211, 5.189, 4.211], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [100.492, 215.929, 100.492], // 2 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.774, 3.913, 2.774], // 2 bits paired groups, 4 rows: a column of a strip
    [87.199, 187.268, 87.199], // 2 bits paired groups, 8 rows: a call
    [12.948, 21.924, 12.948], // 2 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [5.376, 7.151, 5.376], // 2 bits paired groups, 8 rows: a column of a strip
    [65.607, 139.549, 65.607], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [8.708, 8.073, 8.708], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.186, 6.151, 5.186], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [75.319, 160.700, 75.319], // 3 bits single groups, 4 rows: a call
    [7.904, 9.449, 7.904], // 3 bits single groups, 4 rows: a strip
    [26.368, 44.912, 26.368], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.189, 6.155, 5.189], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [66.450, 143.112, 66.450], // 3 bits paired rows, 4 rows: a call
    [16.476, 23.653, 16.476], // 3 bits paired rows, 4 rows: a strip
    [6.492, 13.151, 6.492], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [3.109, 4.112, 3.109], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [85.250, 185.975, 85.250], // 3 bits paired groups, 4 rows: a call
    [5.591, 10.229, 5.591], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.752, 5.127, 3.752], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [66.371, 139.615, 66.371], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a pass or group of a strip
    [8.419, 7.562, 8.419], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.750, 6.123, 4.750], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [75.603, 160.969, 75.603], // 4 bits single groups, 4 rows: a call
    [7.843, 9.291, 7.843], // 4 bits single groups, 4 rows: a strip
    [26.387, 44.961, 26.387], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.752, 6.124, 4.752], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [21.417, 92.158, 21.417], // 4 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [78.004, 99.365, 78.004], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.354, 4.326, 3.354], // 4 bits paired rows, 4 rows: a column of a strip
    [73.862, 162.080, 73.862], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [2.947, 6.005, 2.947], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [28.335, 31.026, 28.335], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.757, 8.255, 6.757], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [97.759, 217.819, 97.759], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.208, 5.573, 4.208], // 4 bits paired groups, 4 rows: a column of a strip
    [86.997, 185.115, 86.997], // 4 bits paired groups, 8 rows: a call
    [8.781, 22.987, 8.781], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [8.034, 10.247, 8.034], // 4 bits paired groups, 8 rows: a column of a strip
    [66.178, 143.560, 66.178], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a pass or group of a strip
    [7.853, 6.676, 7.853], // 8 bits single rows, 4 rows: a chunk of a strip
    [5.249, 7.498, 5.249], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [73.117, 158.004, 73.117], // 8 bits single groups, 4 rows: a call
    [7.860, 9.350, 7.860], // 8 bits single groups, 4 rows: a strip
    [26.385, 44.944, 26.385], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [5.252, 7.499, 5.252], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [69.113, 153.881, 69.113], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [2.035, 4.752, 2.035], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [17.480, 23.352, 17.480], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.384, 4.887, 3.384], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [86.103, 188.187, 86.103], // 8 bits paired groups, 4 rows: a call
    [6.516, 11.163, 6.516], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.066, 6.097, 4.066], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];

//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [100.319, 186.656, 100.319], // a step, with its operations and its action aside
    [10.498, 13.496, 10.498], // a value of the observation
    [271.562, 409.178, 271.562], // an action
    [22.601, 38.938, 22.601], // a value of the action
    [8.935, 10.661, 9.857], // a value of an array of the action contract
    [83.922, 176.982, 83.922], // a call that runs one operation
    [0.000, 0.000, 83.922], // a call that runs pieces
    [0.000, 0.000, 38.809], // an operation that a poll comes to
    [0.000, 0.000, 245.577], // a piece
    [433.165, 778.622, 433.165], // a linear operation
    [0.000, 0.000, 977.361], // a block of rows of a linear operation that a poll comes to
    [26.986, 36.959, 26.986], // eight values compared by magnitude
    [9.676, 13.102, 9.676], // a value compared by magnitude
    [256.489, 419.675, 256.489], // a block of rows whose order is looked at
    [48.345, 85.110, 48.345], // a linear operation that sets its output up before the rows are added
    [1.462, 3.115, 1.462], // an output set to 0 before the rows are added
    [3.886, 5.943, 3.886], // an output set to its bias before the rows are added
    [154.788, 235.941, 154.788], // a block of rows in order, whole strips
    [144.865, 251.778, 144.865], // a block of rows with sums on the stack
    [95.099, 125.802, 95.099], // a run of rows with sums on the stack
    [57.294, 105.574, 57.294], // eight rows scaled by the assembler
    [31.125, 42.410, 31.125], // a row in order scaled
    [34.466, 50.884, 34.466], // a row with an index scaled
    [284.572, 479.835, 284.572], // a normalization
    [24.506, 28.504, 24.591], // a value normalized
    [303.912, 532.887, 303.912], // a layer norm
    [17.763, 25.512, 17.763], // a value of a layer norm
    [259.201, 473.061, 259.201], // an RMS norm
    [10.251, 12.496, 10.251], // a value of an RMS norm
    [215.889, 389.724, 215.889], // an addition
    [5.248, 6.747, 5.248], // a value added
    [215.680, 389.975, 215.680], // a copy
    [2.749, 4.249, 2.749], // a value copied
    [284.573, 524.594, 284.573], // an LSTM cell
    [204.937, 378.800, 204.995], // an element of an LSTM cell
    [304.298, 545.702, 304.298], // a GRU cell
    [134.971, 246.912, 134.998], // an element of a GRU cell
    [179.919, 350.194, 179.919], // a function's operation
    [8.065, 9.057, 8.278], // an element of relu
    [20.918, 32.788, 34.187], // an element of elu
    [38.047, 74.335, 38.187], // an element of silu
    [68.006, 119.520, 68.065], // an element of gelu
    [45.048, 86.330, 45.187], // an element of gelu_tanh
    [48.010, 86.031, 48.065], // an element of tanh
    [38.047, 74.335, 38.187], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [793.668, 1330.815, 793.668], // 2 bits single rows prepared: a chunk
    [92.339, 121.363, 92.339], // 2 bits single rows prepared: a chunk written by itself
    [32.159, 46.280, 32.159], // 2 bits single rows prepared: eight values
    [16.287, 22.384, 16.287], // 2 bits single rows prepared: a value of the rest
    [1.713, 3.323, 1.713], // 2 bits single rows prepared: a pair of padding
    [688.810, 1175.559, 688.810], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [120.960, 184.552, 120.960], // 2 bits single groups prepared: a chunk
    [109.862, 156.235, 109.862], // 2 bits single groups prepared: a chunk written by itself
    [32.750, 47.666, 32.750], // 2 bits single groups prepared: eight values
    [10.601, 11.092, 10.601], // 2 bits single groups prepared: a value of the rest
    [0.000, 0.036, 0.000], // 2 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [803.070, 1374.148, 803.070], // 2 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a chunk
    [130.546, 205.401, 130.546], // 2 bits paired rows prepared: a chunk written by itself
    [39.454, 54.453, 39.454], // 2 bits paired rows prepared: eight values
    [10.292, 8.716, 10.292], // 2 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a pair of padding
    [675.723, 1224.105, 675.723], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [85.718, 154.794, 85.718], // 2 bits paired groups prepared: a chunk
    [122.826, 149.270, 122.826], // 2 bits paired groups prepared: a chunk written by itself
    [45.800, 59.318, 45.800], // 2 bits paired groups prepared: eight values
    [5.839, 4.836, 5.839], // 2 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [788.373, 1319.253, 788.373], // 3 bits single rows prepared: a chunk
    [93.584, 124.696, 93.584], // 3 bits single rows prepared: a chunk written by itself
    [32.200, 46.353, 32.200], // 3 bits single rows prepared: eight values
    [15.782, 21.244, 15.782], // 3 bits single rows prepared: a value of the rest
    [1.750, 3.350, 1.750], // 3 bits single rows prepared: a pair of padding
    [688.950, 1175.276, 688.950], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [121.219, 185.054, 121.219], // 3 bits single groups prepared: a chunk
    [110.153, 157.221, 110.153], // 3 bits single groups prepared: a chunk written by itself
    [32.758, 47.676, 32.758], // 3 bits single groups prepared: eight values
    [10.654, 11.059, 10.654], // 3 bits single groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [813.661, 1401.195, 813.661], // 3 bits paired rows prepared: a group
    [48.271, 65.348, 48.271], // 3 bits paired rows prepared: a chunk
    [67.160, 93.433, 67.160], // 3 bits paired rows prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: eight values
    [13.201, 19.776, 13.201], // 3 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a pair of padding
    [674.220, 1223.759, 674.220], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [76.117, 108.957, 76.117], // 3 bits paired groups prepared: a chunk
    [30.769, 41.015, 30.769], // 3 bits paired groups prepared: a chunk written by itself
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: eight values
    [11.172, 11.282, 11.172], // 3 bits paired groups prepared: a value of the rest
    [8.974, 13.260, 8.974], // 3 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [789.023, 1322.523, 789.023], // 4 bits single rows prepared: a chunk
    [96.396, 126.984, 96.396], // 4 bits single rows prepared: a chunk written by itself
    [32.151, 46.246, 32.151], // 4 bits single rows prepared: eight values
    [15.173, 20.609, 15.173], // 4 bits single rows prepared: a value of the rest
    [1.436, 2.961, 1.436], // 4 bits single rows prepared: a pair of padding
    [689.088, 1175.610, 689.088], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [120.976, 184.756, 120.976], // 4 bits single groups prepared: a chunk
    [109.907, 156.890, 109.907], // 4 bits single groups prepared: a chunk written by itself
    [32.750, 47.659, 32.750], // 4 bits single groups prepared: eight values
    [10.694, 11.166, 10.694], // 4 bits single groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [770.909, 1272.952, 770.909], // 4 bits paired rows prepared: a group
    [124.140, 237.350, 124.140], // 4 bits paired rows prepared: a chunk
    [30.888, 40.651, 30.888], // 4 bits paired rows prepared: a chunk written by itself
    [37.060, 51.371, 37.060], // 4 bits paired rows prepared: eight values
    [12.148, 15.521, 12.148], // 4 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a pair of padding
    [668.298, 1216.689, 668.298], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [158.913, 263.543, 158.913], // 4 bits paired groups prepared: a chunk
    [45.587, 36.490, 45.587], // 4 bits paired groups prepared: a chunk written by itself
    [48.749, 62.982, 48.749], // 4 bits paired groups prepared: eight values
    [5.208, 4.050, 5.208], // 4 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [795.291, 1324.922, 795.291], // 8 bits single rows prepared: a chunk
    [71.778, 96.327, 71.778], // 8 bits single rows prepared: a chunk written by itself
    [32.040, 45.961, 32.040], // 8 bits single rows prepared: eight values
    [16.316, 21.143, 16.316], // 8 bits single rows prepared: a value of the rest
    [2.717, 4.405, 2.717], // 8 bits single rows prepared: a pair of padding
    [689.318, 1175.430, 689.318], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [121.075, 185.268, 121.075], // 8 bits single groups prepared: a chunk
    [110.033, 157.403, 110.033], // 8 bits single groups prepared: a chunk written by itself
    [32.751, 47.647, 32.751], // 8 bits single groups prepared: eight values
    [10.790, 11.343, 10.790], // 8 bits single groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a pair of padding
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [797.660, 1325.942, 797.660], // 8 bits paired rows prepared: a group
    [15.970, 64.704, 15.970], // 8 bits paired rows prepared: a chunk
    [114.432, 158.012, 114.432], // 8 bits paired rows prepared: a chunk written by itself
    [32.302, 46.327, 32.302], // 8 bits paired rows prepared: eight values
    [9.968, 12.536, 9.968], // 8 bits paired rows prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a pair of padding
    [665.077, 1213.060, 665.077], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [79.001, 135.498, 79.001], // 8 bits paired groups prepared: a chunk
    [126.406, 159.615, 126.406], // 8 bits paired groups prepared: a chunk written by itself
    [43.072, 59.592, 43.072], // 8 bits paired groups prepared: eight values
    [5.033, 2.807, 5.033], // 8 bits paired groups prepared: a value of the rest
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a pair of padding
    [62.151, 132.037, 62.151], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a pass or group of a strip
    [8.483, 7.640, 8.483], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.499, 5.434, 4.499], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [75.999, 161.504, 75.999], // 2 bits single groups, 4 rows: a call
    [7.826, 9.248, 7.826], // 2 bits single groups, 4 rows: a strip
    [26.382, 44.945, 26.382], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.502, 5.437, 4.502], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [89.063, 182.683, 89.063], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [32.036, 49.152, 32.036], // 2 bits paired rows, 4 rows: a chunk of a strip
    [1.499, 2.063, 1.499], // 2 bits paired rows, 4 rows: a column of a strip
    [83.158, 178.849, 83.158], // 2 bits paired rows, 8 rows: a call
    [24.025, 32.092, 24.025], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [17.990, 39.747, 17.990], // 2 bits paired rows, 8 rows: a chunk of a strip
    [4.211, 5.190, 4.211], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [100.492, 215.509, 100.492], // 2 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.774, 3.914, 2.774], // 2 bits paired groups, 4 rows: a column of a strip
    [87.199, 187.174, 87.199], // 2 bits paired groups, 8 rows: a call
    [12.948, 21.806, 12.948], // 2 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [5.376, 7.151, 5.376], // 2 bits paired groups, 8 rows: a column of a strip
    [65.607, 139.557, 65.607], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [8.708, 8.038, 8.708], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.186, 6.151, 5.186], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [75.319, 160.648, 75.319], // 3 bits single groups, 4 rows: a call
    [7.904, 9.420, 7.904], // 3 bits single groups, 4 rows: a strip
    [26.368, 44.902, 26.368], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.189, 6.155, 5.189], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [66.450, 143.121, 66.450], // 3 bits paired rows, 4 rows: a call
    [16.476, 23.617, 16.476], // 3 bits paired rows, 4 rows: a strip
    [6.492, 13.151, 6.492], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [3.109, 4.112, 3.109], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [85.250, 185.691, 85.250], // 3 bits paired groups, 4 rows: a call
    [5.591, 10.177, 5.591], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.752, 5.127, 3.752], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [66.371, 139.619, 66.371], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a pass or group of a strip
    [8.419, 7.527, 8.419], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.750, 6.123, 4.750], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [75.603, 160.911, 75.603], // 4 bits single groups, 4 rows: a call
    [7.843, 9.264, 7.843], // 4 bits single groups, 4 rows: a strip
    [26.387, 44.950, 26.387], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.752, 6.124, 4.752], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [21.417, 92.268, 21.417], // 4 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [78.004, 99.218, 78.004], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.354, 4.326, 3.354], // 4 bits paired rows, 4 rows: a column of a strip
    [73.862, 162.078, 73.862], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [2.947, 6.005, 2.947], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [28.335, 30.954, 28.335], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.757, 8.255, 6.757], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [97.759, 217.432, 97.759], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.208, 5.573, 4.208], // 4 bits paired groups, 4 rows: a column of a strip
    [86.997, 185.040, 86.997], // 4 bits paired groups, 8 rows: a call
    [8.781, 22.870, 8.781], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [8.034, 10.247, 8.034], // 4 bits paired groups, 8 rows: a column of a strip
    [66.178, 143.574, 66.178], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a pass or group of a strip
    [7.853, 6.641, 7.853], // 8 bits single rows, 4 rows: a chunk of a strip
    [5.249, 7.498, 5.249], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [73.117, 157.948, 73.117], // 8 bits single groups, 4 rows: a call
    [7.860, 9.323, 7.860], // 8 bits single groups, 4 rows: a strip
    [26.385, 44.932, 26.385], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [5.252, 7.499, 5.252], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [69.113, 153.896, 69.113], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [2.035, 4.753, 2.035], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [17.480, 23.316, 17.480], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.384, 4.887, 3.384], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [86.103, 187.907, 86.103], // 8 bits paired groups, 4 rows: a call
    [6.516, 11.113, 6.516], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.066, 6.097, 4.066], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];

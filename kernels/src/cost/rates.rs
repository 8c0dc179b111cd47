//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [85.706, 150.211, 85.706], // a step, with its operations and its action aside
    [8.999, 14.498, 8.999], // a value of the observation
    [249.617, 397.195, 249.617], // an action
    [96.496, 156.640, 96.496], // a value of the action
    [8.036, 8.026, 8.468], // a value of an array of the action contract
    [60.348, 101.779, 60.348], // a call that runs one operation
    [0.000, 0.000, 60.348], // a call that runs pieces
    [0.000, 0.000, 0.000], // an operation that a poll comes to
    [0.000, 0.000, 388.465], // a piece
    [512.796, 858.188, 512.796], // a linear operation
    [0.000, 0.000, 782.390], // a block of rows of a linear operation that a poll comes to
    [25.960, 38.126, 25.960], // eight values compared by magnitude
    [8.924, 12.655, 8.924], // a value compared by magnitude
    [0.000, 0.000, 0.000], // a block of rows whose order is looked at
    [105.858, 201.198, 105.858], // a linear operation that sets its output up before the rows are added
    [1.536, 3.220, 1.536], // an output set to 0 before the rows are added
    [0.000, 0.786, 0.000], // an output set to its bias before the rows are added
    [118.179, 192.072, 118.179], // a block of rows in order, whole strips
    [75.634, 145.208, 75.634], // a block of rows with sums on the stack
    [141.135, 233.284, 141.135], // a run of rows with sums on the stack
    [45.630, 104.241, 45.630], // eight rows scaled by the assembler
    [10.081, 21.548, 10.081], // a row in order scaled
    [16.535, 25.607, 16.535], // a row with an index scaled
    [527.666, 838.237, 527.666], // a normalization
    [23.998, 31.998, 24.000], // a value normalized
    [498.593, 826.179, 498.593], // a layer norm
    [18.005, 26.751, 18.005], // a value of a layer norm
    [422.476, 717.831, 422.476], // an RMS norm
    [11.749, 20.499, 11.749], // a value of an RMS norm
    [394.023, 625.754, 394.023], // an addition
    [6.002, 7.505, 6.002], // a value added
    [397.558, 631.682, 397.558], // a copy
    [1.000, 3.500, 1.000], // a value copied
    [358.790, 609.512, 358.790], // an LSTM cell
    [125.982, 224.962, 125.999], // an element of an LSTM cell
    [357.892, 607.484, 357.892], // a GRU cell
    [84.931, 148.942, 84.968], // an element of a GRU cell
    [225.201, 376.921, 225.201], // a function's operation
    [5.083, 8.248, 5.802], // an element of relu
    [18.757, 35.282, 28.986], // an element of elu
    [23.834, 48.579, 23.963], // an element of silu
    [30.039, 51.953, 31.741], // an element of gelu
    [27.825, 58.551, 27.963], // an element of gelu_tanh
    [28.933, 54.723, 28.986], // an element of tanh
    [28.915, 54.663, 28.982], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [538.524, 945.348, 538.524], // 2 bits single rows prepared: a chunk
    [32.175, 45.882, 32.175], // 2 bits single rows prepared: eight values
    [84.594, 125.102, 84.594], // 2 bits single rows prepared: a vector that zeros fill up
    [1.022, 3.534, 1.022], // 2 bits single rows prepared: a value of such a vector
    [501.277, 847.545, 501.277], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [8.192, 25.329, 8.192], // 2 bits single groups prepared: a chunk
    [34.071, 44.297, 34.071], // 2 bits single groups prepared: eight values
    [91.218, 127.520, 91.218], // 2 bits single groups prepared: a vector that zeros fill up
    [1.067, 3.407, 1.067], // 2 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [513.141, 914.833, 513.141], // 2 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a chunk
    [40.026, 53.781, 40.026], // 2 bits paired rows prepared: eight values
    [86.168, 132.379, 86.168], // 2 bits paired rows prepared: a vector that zeros fill up
    [1.023, 3.468, 1.023], // 2 bits paired rows prepared: a value of such a vector
    [512.254, 905.914, 512.254], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a chunk
    [41.283, 54.649, 41.283], // 2 bits paired groups prepared: eight values
    [90.349, 105.865, 90.349], // 2 bits paired groups prepared: a vector that zeros fill up
    [1.002, 3.528, 1.002], // 2 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [518.497, 906.596, 518.497], // 3 bits single rows prepared: a chunk
    [32.056, 46.121, 32.056], // 3 bits single rows prepared: eight values
    [86.089, 126.684, 86.089], // 3 bits single rows prepared: a vector that zeros fill up
    [0.996, 3.484, 0.996], // 3 bits single rows prepared: a value of such a vector
    [509.834, 878.131, 509.834], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [7.732, 24.802, 7.732], // 3 bits single groups prepared: a chunk
    [34.059, 44.060, 34.059], // 3 bits single groups prepared: eight values
    [89.039, 121.397, 89.039], // 3 bits single groups prepared: a vector that zeros fill up
    [1.070, 3.405, 1.070], // 3 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [486.294, 876.372, 486.294], // 3 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a chunk
    [39.749, 55.239, 39.749], // 3 bits paired rows prepared: eight values
    [88.263, 134.442, 88.263], // 3 bits paired rows prepared: a vector that zeros fill up
    [0.981, 3.490, 0.981], // 3 bits paired rows prepared: a value of such a vector
    [494.872, 884.622, 494.872], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a chunk
    [42.051, 56.449, 42.051], // 3 bits paired groups prepared: eight values
    [85.204, 125.142, 85.204], // 3 bits paired groups prepared: a vector that zeros fill up
    [0.998, 3.477, 0.998], // 3 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [514.834, 900.004, 514.834], // 4 bits single rows prepared: a chunk
    [32.210, 45.983, 32.210], // 4 bits single rows prepared: eight values
    [84.833, 126.105, 84.833], // 4 bits single rows prepared: a vector that zeros fill up
    [1.005, 3.500, 1.005], // 4 bits single rows prepared: a value of such a vector
    [497.819, 836.900, 497.819], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [8.022, 25.225, 8.022], // 4 bits single groups prepared: a chunk
    [34.152, 44.438, 34.152], // 4 bits single groups prepared: eight values
    [92.026, 131.078, 92.026], // 4 bits single groups prepared: a vector that zeros fill up
    [1.066, 3.396, 1.066], // 4 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [489.790, 849.729, 489.790], // 4 bits paired rows prepared: a group
    [14.758, 55.937, 14.758], // 4 bits paired rows prepared: a chunk
    [37.530, 51.138, 37.530], // 4 bits paired rows prepared: eight values
    [91.349, 137.257, 91.349], // 4 bits paired rows prepared: a vector that zeros fill up
    [0.971, 3.500, 0.971], // 4 bits paired rows prepared: a value of such a vector
    [508.520, 909.286, 508.520], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a chunk
    [41.225, 55.093, 41.225], // 4 bits paired groups prepared: eight values
    [85.431, 123.353, 85.431], // 4 bits paired groups prepared: a vector that zeros fill up
    [1.003, 3.510, 1.003], // 4 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [521.534, 915.535, 521.534], // 8 bits single rows prepared: a chunk
    [32.749, 44.613, 32.749], // 8 bits single rows prepared: eight values
    [78.864, 109.333, 78.864], // 8 bits single rows prepared: a vector that zeros fill up
    [1.015, 3.506, 1.015], // 8 bits single rows prepared: a value of such a vector
    [495.948, 831.252, 495.948], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [7.944, 25.436, 7.944], // 8 bits single groups prepared: a chunk
    [34.158, 44.364, 34.158], // 8 bits single groups prepared: eight values
    [92.054, 131.980, 92.054], // 8 bits single groups prepared: a vector that zeros fill up
    [1.067, 3.394, 1.067], // 8 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [495.006, 882.275, 495.006], // 8 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a chunk
    [33.463, 45.732, 33.463], // 8 bits paired rows prepared: eight values
    [84.575, 121.606, 84.575], // 8 bits paired rows prepared: a vector that zeros fill up
    [1.022, 3.583, 1.022], // 8 bits paired rows prepared: a value of such a vector
    [489.841, 879.231, 489.841], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a chunk
    [36.554, 49.715, 36.554], // 8 bits paired groups prepared: eight values
    [85.280, 125.569, 85.280], // 8 bits paired groups prepared: a vector that zeros fill up
    [0.998, 3.477, 0.998], // 8 bits paired groups prepared: a value of such a vector
    [19.574, 44.816, 19.574], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [3.054, 3.939, 3.054], // 2 bits single rows, 4 rows: a pass or group of a strip
    [16.252, 24.118, 16.252], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.324, 5.143, 4.324], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [43.859, 128.458, 43.859], // 2 bits single groups, 4 rows: a call
    [16.592, 20.029, 16.592], // 2 bits single groups, 4 rows: a strip
    [23.673, 40.618, 23.673], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.382, 5.283, 4.382], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [45.622, 65.528, 45.622], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [17.183, 40.605, 17.183], // 2 bits paired rows, 4 rows: a chunk of a strip
    [2.251, 2.904, 2.251], // 2 bits paired rows, 4 rows: a column of a strip
    [39.297, 85.556, 39.297], // 2 bits paired rows, 8 rows: a call
    [35.953, 30.674, 35.953], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [24.550, 48.136, 24.550], // 2 bits paired rows, 8 rows: a chunk of a strip
    [3.991, 4.902, 3.991], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [33.723, 69.598, 33.723], // 2 bits paired groups, 4 rows: a strip
    [12.378, 0.000, 12.378], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.980, 4.364, 2.980], // 2 bits paired groups, 4 rows: a column of a strip
    [39.020, 83.691, 39.020], // 2 bits paired groups, 8 rows: a call
    [21.265, 19.483, 21.265], // 2 bits paired groups, 8 rows: a strip
    [45.564, 52.811, 45.564], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [4.500, 5.961, 4.500], // 2 bits paired groups, 8 rows: a column of a strip
    [39.610, 81.423, 39.610], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [14.945, 21.555, 14.945], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.204, 6.170, 5.204], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [39.124, 111.353, 39.124], // 3 bits single groups, 4 rows: a call
    [14.526, 14.493, 14.526], // 3 bits single groups, 4 rows: a strip
    [23.709, 40.430, 23.709], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.165, 6.204, 5.165], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [57.548, 109.977, 57.548], // 3 bits paired rows, 4 rows: a call
    [21.763, 23.853, 21.763], // 3 bits paired rows, 4 rows: a strip
    [15.467, 27.260, 15.467], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [2.958, 3.855, 2.958], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [46.724, 93.812, 46.724], // 3 bits paired groups, 4 rows: a call
    [11.054, 8.084, 11.054], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.656, 5.029, 3.656], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [43.074, 89.382, 43.074], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [3.132, 4.422, 3.132], // 4 bits single rows, 4 rows: a pass or group of a strip
    [16.330, 24.308, 16.330], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.383, 5.438, 4.383], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [45.767, 134.337, 45.767], // 4 bits single groups, 4 rows: a call
    [17.044, 21.293, 17.044], // 4 bits single groups, 4 rows: a strip
    [23.755, 40.806, 23.755], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.441, 5.588, 4.441], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [33.987, 79.982, 33.987], // 4 bits paired rows, 4 rows: a strip
    [0.000, 12.415, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [29.027, 0.000, 29.027], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.583, 4.596, 3.583], // 4 bits paired rows, 4 rows: a column of a strip
    [46.048, 97.022, 46.048], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [12.882, 23.213, 12.882], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [37.105, 30.261, 37.105], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.414, 7.654, 6.414], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [33.347, 62.945, 33.347], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.367, 5.910, 4.367], // 4 bits paired groups, 4 rows: a column of a strip
    [30.948, 68.116, 30.948], // 4 bits paired groups, 8 rows: a call
    [18.825, 10.400, 18.825], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [7.753, 9.970, 7.753], // 4 bits paired groups, 8 rows: a column of a strip
    [26.658, 70.901, 26.658], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [3.370, 6.158, 3.370], // 8 bits single rows, 4 rows: a pass or group of a strip
    [16.607, 22.480, 16.607], // 8 bits single rows, 4 rows: a chunk of a strip
    [4.491, 6.027, 4.491], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [45.677, 138.339, 45.677], // 8 bits single groups, 4 rows: a call
    [17.041, 21.219, 17.041], // 8 bits single groups, 4 rows: a strip
    [23.775, 40.791, 23.775], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [4.566, 6.215, 4.566], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [43.421, 93.014, 43.421], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [14.531, 24.465, 14.531], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [23.502, 26.343, 23.502], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.157, 4.526, 3.157], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [44.684, 89.632, 44.684], // 8 bits paired groups, 4 rows: a call
    [11.057, 10.164, 11.057], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.062, 6.091, 4.062], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];

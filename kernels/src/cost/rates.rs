//! Written by `cargo xtask fit`: expected instructions, expected cycles, instructions at most.

#[rustfmt::skip]
pub(super) const RATES: &[[f64; 3]] = &[
    [85.707, 150.211, 85.707], // a step, with its operations and its action aside
    [8.999, 14.498, 8.999], // a value of the observation
    [249.611, 397.192, 249.611], // an action
    [96.496, 156.639, 96.496], // a value of the action
    [8.036, 8.026, 8.468], // a value of an array of the action contract
    [60.357, 101.783, 60.357], // a call that runs one operation
    [0.000, 0.000, 60.357], // a call that runs pieces
    [0.000, 0.000, 0.000], // an operation that a poll comes to
    [0.000, 0.000, 387.852], // a piece
    [512.787, 858.197, 512.787], // a linear operation
    [0.000, 0.000, 804.003], // a block of rows of a linear operation that a poll comes to
    [25.961, 38.126, 25.961], // eight values compared by magnitude
    [8.924, 12.656, 8.924], // a value compared by magnitude
    [0.000, 0.000, 0.000], // a block of rows whose order is looked at
    [105.855, 201.194, 105.855], // a linear operation that sets its output up before the rows are added
    [1.536, 3.220, 1.536], // an output set to 0 before the rows are added
    [0.000, 0.786, 0.000], // an output set to its bias before the rows are added
    [118.173, 192.045, 118.173], // a block of rows in order, whole strips
    [75.626, 145.154, 75.626], // a block of rows with sums on the stack
    [141.130, 233.301, 141.130], // a run of rows with sums on the stack
    [45.577, 104.134, 45.577], // eight rows scaled by the assembler
    [10.074, 21.535, 10.074], // a row in order scaled
    [16.529, 25.594, 16.529], // a row with an index scaled
    [527.657, 838.233, 527.657], // a normalization
    [23.998, 31.998, 24.000], // a value normalized
    [498.584, 826.174, 498.584], // a layer norm
    [18.005, 26.751, 18.005], // a value of a layer norm
    [422.467, 717.827, 422.467], // an RMS norm
    [11.749, 20.499, 11.749], // a value of an RMS norm
    [394.014, 625.750, 394.014], // an addition
    [6.002, 7.505, 6.002], // a value added
    [397.549, 631.677, 397.549], // a copy
    [1.000, 3.500, 1.000], // a value copied
    [358.782, 609.508, 358.782], // an LSTM cell
    [125.982, 224.962, 125.999], // an element of an LSTM cell
    [357.883, 607.479, 357.883], // a GRU cell
    [84.931, 148.942, 84.968], // an element of a GRU cell
    [225.192, 376.929, 225.192], // a function's operation
    [5.083, 8.248, 5.802], // an element of relu
    [18.757, 35.812, 28.986], // an element of elu
    [23.834, 48.579, 23.963], // an element of silu
    [30.039, 51.952, 31.741], // an element of gelu
    [27.825, 58.551, 27.963], // an element of gelu_tanh
    [28.933, 55.721, 28.986], // an element of tanh
    [28.915, 55.661, 28.982], // an element of sigmoid
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single rows prepared: a group
    [538.515, 945.347, 538.515], // 2 bits single rows prepared: a chunk
    [32.174, 45.882, 32.174], // 2 bits single rows prepared: eight values
    [84.593, 125.095, 84.593], // 2 bits single rows prepared: a vector that zeros fill up
    [1.022, 3.534, 1.022], // 2 bits single rows prepared: a value of such a vector
    [501.295, 847.558, 501.295], // 2 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits single groups prepared: a group
    [8.189, 25.330, 8.189], // 2 bits single groups prepared: a chunk
    [34.070, 44.297, 34.070], // 2 bits single groups prepared: eight values
    [91.224, 127.516, 91.224], // 2 bits single groups prepared: a vector that zeros fill up
    [1.067, 3.407, 1.067], // 2 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a vector
    [513.152, 914.849, 513.152], // 2 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired rows prepared: a chunk
    [40.023, 53.782, 40.023], // 2 bits paired rows prepared: eight values
    [86.163, 132.375, 86.163], // 2 bits paired rows prepared: a vector that zeros fill up
    [1.023, 3.468, 1.023], // 2 bits paired rows prepared: a value of such a vector
    [512.266, 905.929, 512.266], // 2 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 2 bits paired groups prepared: a chunk
    [41.281, 54.649, 41.281], // 2 bits paired groups prepared: eight values
    [90.354, 105.859, 90.354], // 2 bits paired groups prepared: a vector that zeros fill up
    [1.002, 3.528, 1.002], // 2 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single rows prepared: a group
    [518.490, 906.604, 518.490], // 3 bits single rows prepared: a chunk
    [32.056, 46.121, 32.056], // 3 bits single rows prepared: eight values
    [86.086, 126.670, 86.086], // 3 bits single rows prepared: a vector that zeros fill up
    [0.996, 3.484, 0.996], // 3 bits single rows prepared: a value of such a vector
    [509.850, 878.144, 509.850], // 3 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits single groups prepared: a group
    [7.728, 24.803, 7.728], // 3 bits single groups prepared: a chunk
    [34.057, 44.060, 34.057], // 3 bits single groups prepared: eight values
    [89.045, 121.393, 89.045], // 3 bits single groups prepared: a vector that zeros fill up
    [1.071, 3.405, 1.071], // 3 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a vector
    [486.318, 876.390, 486.318], // 3 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired rows prepared: a chunk
    [39.746, 55.240, 39.746], // 3 bits paired rows prepared: eight values
    [88.267, 134.442, 88.267], // 3 bits paired rows prepared: a vector that zeros fill up
    [0.981, 3.490, 0.981], // 3 bits paired rows prepared: a value of such a vector
    [494.883, 884.637, 494.883], // 3 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 3 bits paired groups prepared: a chunk
    [42.049, 56.449, 42.049], // 3 bits paired groups prepared: eight values
    [85.208, 125.139, 85.208], // 3 bits paired groups prepared: a vector that zeros fill up
    [0.998, 3.477, 0.998], // 3 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single rows prepared: a group
    [514.831, 900.006, 514.831], // 4 bits single rows prepared: a chunk
    [32.210, 45.983, 32.210], // 4 bits single rows prepared: eight values
    [84.832, 126.099, 84.832], // 4 bits single rows prepared: a vector that zeros fill up
    [1.005, 3.500, 1.005], // 4 bits single rows prepared: a value of such a vector
    [497.837, 836.912, 497.837], // 4 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits single groups prepared: a group
    [8.018, 25.226, 8.018], // 4 bits single groups prepared: a chunk
    [34.150, 44.438, 34.150], // 4 bits single groups prepared: eight values
    [92.031, 131.074, 92.031], // 4 bits single groups prepared: a vector that zeros fill up
    [1.066, 3.396, 1.066], // 4 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 4 bits paired rows prepared: a vector
    [489.707, 849.703, 489.707], // 4 bits paired rows prepared: a group
    [14.813, 55.994, 14.813], // 4 bits paired rows prepared: a chunk
    [37.535, 51.135, 37.535], // 4 bits paired rows prepared: eight values
    [91.322, 137.222, 91.322], // 4 bits paired rows prepared: a vector that zeros fill up
    [0.972, 3.501, 0.972], // 4 bits paired rows prepared: a value of such a vector
    [508.529, 909.305, 508.529], // 4 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 4 bits paired groups prepared: a chunk
    [41.224, 55.093, 41.224], // 4 bits paired groups prepared: eight values
    [85.435, 123.354, 85.435], // 4 bits paired groups prepared: a vector that zeros fill up
    [1.003, 3.510, 1.003], // 4 bits paired groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single rows prepared: a group
    [521.551, 915.563, 521.551], // 8 bits single rows prepared: a chunk
    [32.747, 44.614, 32.747], // 8 bits single rows prepared: eight values
    [78.871, 109.338, 78.871], // 8 bits single rows prepared: a vector that zeros fill up
    [1.015, 3.506, 1.015], // 8 bits single rows prepared: a value of such a vector
    [495.967, 831.265, 495.967], // 8 bits single groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits single groups prepared: a group
    [7.940, 25.438, 7.940], // 8 bits single groups prepared: a chunk
    [34.157, 44.364, 34.157], // 8 bits single groups prepared: eight values
    [92.059, 131.976, 92.059], // 8 bits single groups prepared: a vector that zeros fill up
    [1.067, 3.394, 1.067], // 8 bits single groups prepared: a value of such a vector
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a vector
    [495.048, 882.318, 495.048], // 8 bits paired rows prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired rows prepared: a chunk
    [33.462, 45.732, 33.462], // 8 bits paired rows prepared: eight values
    [84.586, 121.620, 84.586], // 8 bits paired rows prepared: a vector that zeros fill up
    [1.022, 3.583, 1.022], // 8 bits paired rows prepared: a value of such a vector
    [489.852, 879.246, 489.852], // 8 bits paired groups prepared: a vector
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a group
    [0.000, 0.000, 0.000], // 8 bits paired groups prepared: a chunk
    [36.552, 49.716, 36.552], // 8 bits paired groups prepared: eight values
    [85.284, 125.567, 85.284], // 8 bits paired groups prepared: a vector that zeros fill up
    [0.998, 3.477, 0.998], // 8 bits paired groups prepared: a value of such a vector
    [19.583, 44.833, 19.583], // 2 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 4 rows: a strip
    [3.053, 3.938, 3.053], // 2 bits single rows, 4 rows: a pass or group of a strip
    [16.280, 24.171, 16.280], // 2 bits single rows, 4 rows: a chunk of a strip
    [4.325, 5.143, 4.325], // 2 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single rows, 8 rows: a column of a strip
    [43.849, 128.459, 43.849], // 2 bits single groups, 4 rows: a call
    [16.619, 20.082, 16.619], // 2 bits single groups, 4 rows: a strip
    [23.674, 40.618, 23.674], // 2 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 4 rows: a chunk of a strip
    [4.382, 5.283, 4.382], // 2 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 2 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a call
    [45.661, 65.579, 45.661], // 2 bits paired rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 4 rows: a pass or group of a strip
    [17.150, 40.594, 17.150], // 2 bits paired rows, 4 rows: a chunk of a strip
    [2.252, 2.904, 2.252], // 2 bits paired rows, 4 rows: a column of a strip
    [39.299, 85.556, 39.299], // 2 bits paired rows, 8 rows: a call
    [36.005, 30.780, 36.005], // 2 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 2 bits paired rows, 8 rows: a pass or group of a strip
    [24.550, 48.137, 24.550], // 2 bits paired rows, 8 rows: a chunk of a strip
    [3.991, 4.902, 3.991], // 2 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a call
    [33.743, 69.649, 33.743], // 2 bits paired groups, 4 rows: a strip
    [12.388, 0.000, 12.388], // 2 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 4 rows: a chunk of a strip
    [2.980, 4.364, 2.980], // 2 bits paired groups, 4 rows: a column of a strip
    [39.019, 83.691, 39.019], // 2 bits paired groups, 8 rows: a call
    [21.318, 19.589, 21.318], // 2 bits paired groups, 8 rows: a strip
    [45.564, 52.811, 45.564], // 2 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 2 bits paired groups, 8 rows: a chunk of a strip
    [4.500, 5.961, 4.500], // 2 bits paired groups, 8 rows: a column of a strip
    [39.618, 81.437, 39.618], // 3 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 4 rows: a pass or group of a strip
    [14.974, 21.608, 14.974], // 3 bits single rows, 4 rows: a chunk of a strip
    [5.204, 6.170, 5.204], // 3 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single rows, 8 rows: a column of a strip
    [39.115, 111.354, 39.115], // 3 bits single groups, 4 rows: a call
    [14.552, 14.546, 14.552], // 3 bits single groups, 4 rows: a strip
    [23.709, 40.430, 23.709], // 3 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 4 rows: a chunk of a strip
    [5.165, 6.204, 5.165], // 3 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits single groups, 8 rows: a column of a strip
    [57.536, 109.972, 57.536], // 3 bits paired rows, 4 rows: a call
    [21.789, 23.905, 21.789], // 3 bits paired rows, 4 rows: a strip
    [15.466, 27.261, 15.466], // 3 bits paired rows, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 4 rows: a chunk of a strip
    [2.958, 3.855, 2.958], // 3 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired rows, 8 rows: a column of a strip
    [46.720, 93.812, 46.720], // 3 bits paired groups, 4 rows: a call
    [11.081, 8.137, 11.081], // 3 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 4 rows: a chunk of a strip
    [3.656, 5.029, 3.656], // 3 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 3 bits paired groups, 8 rows: a column of a strip
    [43.077, 89.394, 43.077], // 4 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 4 rows: a strip
    [3.131, 4.421, 3.131], // 4 bits single rows, 4 rows: a pass or group of a strip
    [16.358, 24.361, 16.358], // 4 bits single rows, 4 rows: a chunk of a strip
    [4.383, 5.438, 4.383], // 4 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single rows, 8 rows: a column of a strip
    [45.756, 134.339, 45.756], // 4 bits single groups, 4 rows: a call
    [17.071, 21.346, 17.071], // 4 bits single groups, 4 rows: a strip
    [23.755, 40.806, 23.755], // 4 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 4 rows: a chunk of a strip
    [4.441, 5.588, 4.441], // 4 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 4 bits single groups, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired rows, 4 rows: a call
    [34.089, 80.066, 34.089], // 4 bits paired rows, 4 rows: a strip
    [0.000, 12.324, 0.000], // 4 bits paired rows, 4 rows: a pass or group of a strip
    [28.953, 0.000, 28.953], // 4 bits paired rows, 4 rows: a chunk of a strip
    [3.583, 4.599, 3.583], // 4 bits paired rows, 4 rows: a column of a strip
    [46.094, 97.064, 46.094], // 4 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 4 bits paired rows, 8 rows: a strip
    [13.923, 24.261, 13.923], // 4 bits paired rows, 8 rows: a pass or group of a strip
    [37.140, 30.335, 37.140], // 4 bits paired rows, 8 rows: a chunk of a strip
    [6.287, 7.527, 6.287], // 4 bits paired rows, 8 rows: a column of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a call
    [33.371, 62.993, 33.371], // 4 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 4 rows: a chunk of a strip
    [4.367, 5.910, 4.367], // 4 bits paired groups, 4 rows: a column of a strip
    [30.947, 68.107, 30.947], // 4 bits paired groups, 8 rows: a call
    [18.879, 10.507, 18.879], // 4 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 4 bits paired groups, 8 rows: a chunk of a strip
    [7.753, 10.001, 7.753], // 4 bits paired groups, 8 rows: a column of a strip
    [26.642, 70.877, 26.642], // 8 bits single rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 4 rows: a strip
    [3.369, 6.156, 3.369], // 8 bits single rows, 4 rows: a pass or group of a strip
    [16.633, 22.533, 16.633], // 8 bits single rows, 4 rows: a chunk of a strip
    [4.491, 6.027, 4.491], // 8 bits single rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single rows, 8 rows: a column of a strip
    [45.666, 138.341, 45.666], // 8 bits single groups, 4 rows: a call
    [17.067, 21.272, 17.067], // 8 bits single groups, 4 rows: a strip
    [23.775, 40.791, 23.775], // 8 bits single groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 4 rows: a chunk of a strip
    [4.565, 6.215, 4.565], // 8 bits single groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits single groups, 8 rows: a column of a strip
    [43.383, 92.978, 43.383], // 8 bits paired rows, 4 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 4 rows: a strip
    [14.530, 24.465, 14.530], // 8 bits paired rows, 4 rows: a pass or group of a strip
    [23.528, 26.395, 23.528], // 8 bits paired rows, 4 rows: a chunk of a strip
    [3.157, 4.526, 3.157], // 8 bits paired rows, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired rows, 8 rows: a column of a strip
    [44.680, 89.631, 44.680], // 8 bits paired groups, 4 rows: a call
    [11.084, 10.217, 11.084], // 8 bits paired groups, 4 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 4 rows: a chunk of a strip
    [4.062, 6.091, 4.062], // 8 bits paired groups, 4 rows: a column of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a call
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a pass or group of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a chunk of a strip
    [0.000, 0.000, 0.000], // 8 bits paired groups, 8 rows: a column of a strip
];

{% if cookiecutter.what == "simulator" %}
{{ plain("my_simulator.py", "my_simulator", cookiecutter.name) -}}
{% endif %}

{% if cookiecutter.what == "controller" %}
{{ plain("my_controller.py", "my_controller", cookiecutter.name) -}}
{% endif %}
